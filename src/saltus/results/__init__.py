"""Results: the schema of every Dataset, where it comes from, and files."""

from saltus.results.dataset.assemble import Contacts, Guards, stroboscope_dataset, trajectory_dataset
from saltus.results.dataset.assemble_motions import motion_dataset, spectrum_dataset
from saltus.results.dataset.basins import AttractorTable, agreement_dataset, attractors_dataset, basins_dataset
from saltus.results.dataset.exponents import exponents_dataset
from saltus.results.dataset.methods import methods_dataset
from saltus.results.dataset.responses import Events, OutputNumbers, Responses, Starts, responses_dataset
from saltus.results.dataset.result import Result
from saltus.results.describe import describe
from saltus.results.files.atomic import ResultFileError, usable_folder
from saltus.results.files.export import save, to_csv, to_mat, to_netcdf
from saltus.results.files.frames import contacts, samples
from saltus.results.files.load import load
from saltus.results.provenance import attributes, content_hash

__all__ = [
    "AttractorTable",
    "Contacts",
    "Events",
    "Guards",
    "OutputNumbers",
    "Responses",
    "Result",
    "ResultFileError",
    "Starts",
    "agreement_dataset",
    "attractors_dataset",
    "attributes",
    "basins_dataset",
    "contacts",
    "content_hash",
    "describe",
    "exponents_dataset",
    "load",
    "methods_dataset",
    "motion_dataset",
    "responses_dataset",
    "samples",
    "save",
    "spectrum_dataset",
    "stroboscope_dataset",
    "to_csv",
    "to_mat",
    "to_netcdf",
    "trajectory_dataset",
    "usable_folder",
]

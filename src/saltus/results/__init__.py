"""Results: the schema of every Dataset, where it comes from, and files."""

from saltus.results.assemble import Contacts, Guards, stroboscope_dataset, trajectory_dataset
from saltus.results.assemble_motions import motion_dataset, spectrum_dataset
from saltus.results.basins import AttractorTable, agreement_dataset, attractors_dataset, basins_dataset
from saltus.results.exponents import exponents_dataset
from saltus.results.export import save, to_csv, to_mat, to_netcdf
from saltus.results.files import ResultFileError, usable_folder
from saltus.results.frames import contacts, samples
from saltus.results.load import load
from saltus.results.methods import methods_dataset
from saltus.results.provenance import attributes, content_hash, describe
from saltus.results.responses import Events, OutputNumbers, Responses, Starts, responses_dataset
from saltus.results.result import Result

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

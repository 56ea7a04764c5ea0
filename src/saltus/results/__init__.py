"""Results: the schema of every Dataset, its provenance, and files."""

from saltus.results import kinds as kinds
from saltus.results.dataset.attractors import AttractorTable
from saltus.results.dataset.build import Guards, Subject, build, subject_of
from saltus.results.dataset.result import Result
from saltus.results.describe import describe, headline
from saltus.results.files.atomic import ResultFileError, usable_folder
from saltus.results.files.export import save, to_csv, to_mat, to_netcdf
from saltus.results.files.frames import contacts, samples
from saltus.results.files.join import join
from saltus.results.files.load import load
from saltus.results.provenance import attributes, content_hash, inherited, made_by

Result._headline = headline

__all__ = [
    "AttractorTable",
    "Guards",
    "Result",
    "ResultFileError",
    "Subject",
    "attributes",
    "build",
    "contacts",
    "content_hash",
    "describe",
    "inherited",
    "join",
    "load",
    "made_by",
    "samples",
    "save",
    "subject_of",
    "to_csv",
    "to_mat",
    "to_netcdf",
    "usable_folder",
]

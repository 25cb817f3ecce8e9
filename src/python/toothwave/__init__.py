"""Forces and contact stresses of discrete-tooth harmonic drives, and studies of their variants.

A design is what the service takes: a dict, JSON text, or the path of a JSON file. Answers are dicts like the service's JSON; their columns are
NumPy arrays. A document without an answer raises `Problem`.
"""

from ._answers import Answer, Sweep, coincidence_degree, drawing, geometry, sweep
from ._native import PartError, Problem, __version__
from ._studies import Gap, Study, StudyResult
from ._tables import Columns

__all__ = [
    "Answer",
    "Columns",
    "Gap",
    "PartError",
    "Problem",
    "Study",
    "StudyResult",
    "Sweep",
    "__version__",
    "coincidence_degree",
    "drawing",
    "geometry",
    "sweep",
]

"""Forces and contact stresses of discrete-tooth harmonic drives, and studies of their variants.

A design has the form of the service's design document: a dict, JSON text, or a `pathlib.Path` of a JSON file. Answers are mappings with the names
of the service's JSON. Their columns are NumPy arrays. An invalid document raises `Problem`.
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

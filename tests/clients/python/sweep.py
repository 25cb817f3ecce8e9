"""A sweep of case 5.1 by the generated client, which stands in ./generated: sweep.py URL"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path.cwd()))

from generated import Client
from generated.api.drive import drawing, sweep
from generated.models import Design, DrawnPart, OutlineAnswerCircle, Problem, SweepAnswer

design = {
    "drive": {
        "wave_generator": {"kind": "ellipse", "semi_major_mm": 58.0, "semi_minor_mm": 56.0},
        "teeth": {"shape": "cylinder", "count": 28, "radius_mm": 5.0, "width_mm": 15.0},
        "ring": {"teeth": 26},
    },
    "load": {"input_torque_nm": 20.0},
    "model": {"compatibility": "projection", "stiffness": {"law": "linear"}},
}
client = Client(base_url=sys.argv[1])
answer = sweep.sync(client=client, body=Design.from_dict(design))
assert isinstance(answer, SweepAnswer), answer
print(answer.peaks.wave_generator.force_n.value)

tooth = drawing.sync(DrawnPart.TOOTH, client=client, body=Design.from_dict(design))
assert isinstance(tooth.bodies[0].outer, OutlineAnswerCircle), tooth

design["drive"]["teeth"]["radius_mm"] = -1.0
refused = sweep.sync(client=client, body=Design.from_dict(design))
assert isinstance(refused, Problem) and refused.errors[0].pointer == "/drive/teeth/radius_mm", refused

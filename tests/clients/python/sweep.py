"""All calls by the client of openapi-python-client, which stands in ./generated: sweep.py URL"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path.cwd()))

from generated import Client
from generated.api.drive import accuracy, coincidence_degree, design, drawing, geometry, sweep
from generated.api.service import example, examples
from generated.api.studies import begin, cancel, quantities, study
from generated.models import AccuracyAnswer, Design, DrawnPart, OutlineAnswerCircle, Problem, StudyMap, SweepAnswer

client = Client(base_url=sys.argv[1])
for ready in examples.sync(client=client).examples:
    document = example.sync(ready.name, client=client)
    assert isinstance(document, Design), document
    assert geometry.sync(client=client, body=document).findings is not None, ready.name
    assert coincidence_degree.sync(client=client, body=document).coincidence_degree > 0.0, ready.name
    assert design.sync(client=client, body=document).sweep.peaks.ring.force_n.value > 0.0, ready.name
    assert drawing.sync(DrawnPart.ASSEMBLY, client=client, body=document).bodies, ready.name

case = example.sync("paper-5.1", client=client)
assert isinstance(accuracy.sync(client=client, body=case), AccuracyAnswer)
answer = sweep.sync(client=client, body=case)
assert isinstance(answer, SweepAnswer), answer
print(answer.peaks.wave_generator.force_n.value)

tooth = drawing.sync(DrawnPart.TOOTH, client=client, body=case)
assert isinstance(tooth.bodies[0].outer, OutlineAnswerCircle), tooth

assert quantities.sync(client=client).quantities
over = {"/load/input_torque_nm": {"min": 1.0, "max": 2.0, "steps": 3}}
asked = StudyMap.from_dict({"study": "map", "base": case.to_dict(), "over": over})
found = begin.sync(client=client, body=asked, prefer="wait=9")
assert found.result.variants == 3, found
assert cancel.sync_detailed(found.id, client=client).status_code == 204
assert isinstance(study.sync(found.id, client=client), Problem)

case.drive.teeth.radius_mm = -1.0
refused = sweep.sync(client=client, body=case)
assert isinstance(refused, Problem) and refused.errors[0].pointer == "/drive/teeth/radius_mm", refused

"""All calls by the client of openapi-generator, which stands in ./generated: client.py URL"""

import sys

sys.path.insert(0, "generated")

import openapi_client
from openapi_client import ApiException, DriveApi, DrawnPart, ServiceApi, StudiesApi, Study

client = openapi_client.ApiClient(openapi_client.Configuration(host=sys.argv[1]))
drive, studies, service = DriveApi(client), StudiesApi(client), ServiceApi(client)

for example in service.examples().examples:
    design = service.example(example.name)
    assert drive.geometry(design).findings is not None, example.name
    assert drive.coincidence_degree(design).coincidence_degree > 0.0, example.name
    assert drive.sweep(design).peaks.ring.force_n.value > 0.0, example.name
    assert drive.design(design).sweep.peaks.ring.force_n.value > 0.0, example.name
    assert drive.drawing(DrawnPart.ASSEMBLY, design).bodies, example.name

design = service.example("paper-5.1")
assert drive.accuracy(design).ways
print(drive.sweep(design).peaks.wave_generator.force_n.value)

assert studies.quantities().quantities
over = {"/load/input_torque_nm": {"min": 1.0, "max": 2.0, "steps": 3}}
study = studies.begin(Study.from_dict({"study": "map", "base": design.to_dict(), "over": over}), prefer="wait=9")
assert study.result.actual_instance.variants == 3, study
studies.cancel(study.id)
try:
    studies.study(study.id)
    raise AssertionError("the study is still there")
except ApiException as error:
    assert error.status == 404, error

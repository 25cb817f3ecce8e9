"""A drive in an assembly, as a plug-in gets it from a toothwave service: python3 plug_in.py URL DESIGN.json"""

import json
import math
import os
import sys
import time
import urllib.error
import urllib.request

KEPT = 32  # as many tags as a request's headers have room for

answers = {}  # entity tag -> drawing: what this plug-in has already, the oldest first


def drawing(url, design, attempts=4):
    """All parts in place; asked for again only where the design has changed in what a drawing reads."""
    request = urllib.request.Request(f"{url}/v1/drawings/assembly", json.dumps(design).encode())
    request.add_header("Content-Type", "application/json")
    if key := os.environ.get("TOOTHWAVE_KEY"):  # where the service wants one
        request.add_header("Authorization", f"Bearer {key}")
    if answers:
        request.add_header("If-None-Match", ", ".join(answers))
    try:
        with urllib.request.urlopen(request, timeout=30) as response:
            tag = response.headers["ETag"]
            answers[tag] = json.load(response)
            while len(answers) > KEPT:
                del answers[next(iter(answers))]
    except urllib.error.HTTPError as error:
        if error.code in (502, 503, 504) and attempts > 1:
            time.sleep(float(error.headers.get("Retry-After", 1)))
            return drawing(url, design, attempts - 1)
        if error.code != 304:
            problem = json.load(error)
            faults = [f"{fault['pointer']}: {fault['detail']}" for fault in problem.get("errors", [])]
            raise SystemExit("\n".join([problem["title"], *(faults or [problem["detail"]])])) from None
        tag = error.headers["ETag"]
    return answers[tag]


def placed(point, placement):
    """A point of a section, where its body stands: turned about the section's origin, then moved."""
    (x, y), turn = point, math.radians(placement["rotation_deg"])
    return (
        placement["x_mm"] + x * math.cos(turn) - y * math.sin(turn),
        placement["y_mm"] + x * math.sin(turn) + y * math.cos(turn),
    )


def main(url, file):
    with open(file, encoding="utf-8") as text:
        design = json.load(text)
    for input_angle_deg in (0.0, 10.0, 0.0):  # the third is not sent again
        assembly = drawing(url, design | {"assembly": {"input_angle_deg": input_angle_deg}})
        for body in assembly["bodies"]:
            # A CAD system makes the section of body["outer"] and body["holes"] here, extrudes it and places it.
            x_mm, y_mm = placed((0.0, 0.0), body["placements"][0])
            print(
                f"{input_angle_deg:4.0f} deg  {body['part']:14} {len(body['placements']):3} of {body['outer']['kind']},",
                f"{body['width_mm']} mm wide, the first at ({x_mm:.4f}, {y_mm:.4f}) mm",
            )
    print(f"{len(answers)} drawings were sent")


if __name__ == "__main__":
    main(*sys.argv[1:])

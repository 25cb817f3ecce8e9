"""A drive in an assembly, as a plug-in gets it from a toothwave service: python3 plug_in.py URL DESIGN.json"""

import email.utils
import http.client
import json
import math
import os
import sys
import time
import urllib.error
import urllib.parse
import urllib.request

KEPT = 32  # as many tags as a request's headers have room for
ATTEMPTS = 4
LOST = (ConnectionResetError, ConnectionAbortedError, BrokenPipeError, http.client.IncompleteRead)

answers = {}  # entity tag -> drawing: what this plug-in has already, the oldest first


def drawing(url, design):
    """All parts in place; asked for again only where the design has changed in what a drawing reads."""
    tag, answer = asked(url, design, answers)
    if answer is None and tag not in answers:  # a proxy mixed something up
        tag, answer = asked(url, design, {})
    if answer is None:
        return answers[tag] if tag in answers else no_service(url, "nothing changed, it says, of what it never sent")
    if not (isinstance(answer, dict) and "bodies" in answer):
        no_service(url, "the answer is no drawing")
    answers[tag] = answer
    while len(answers) > KEPT:
        del answers[next(iter(answers))]
    return answer


def asked(url, design, known):
    """Entity tag and drawing; no drawing where the one with this tag still holds."""
    for left in reversed(range(ATTEMPTS)):
        pause_s = 1.0
        try:
            request = urllib.request.Request(f"{address_of(url)}/v1/drawings/assembly", json.dumps(design).encode())
            request.add_header("Content-Type", "application/json")
            if key := key_of(os.environ):  # where the service wants one; nobody else gets it
                request.add_unredirected_header("Authorization", f"Bearer {key}")
            if known:
                request.add_header("If-None-Match", ", ".join(filter(None, known)))
            with opener_for(request.host).open(request, timeout=30) as response:
                return response.headers["ETag"], json.load(response)
        except urllib.error.HTTPError as error:
            if error.code == 304:
                return error.headers["ETag"], None
            if error.code not in (502, 503, 504) or not left:
                objection(url, error)
            pause_s = pause_of(error.headers["Retry-After"])
        except (OSError, ValueError, OverflowError, http.client.HTTPException) as error:
            reason = getattr(error, "reason", error)
            if not isinstance(reason, LOST) or not left:  # else a replica died; another one may be there
                no_service(url, reason)
        time.sleep(pause_s)


def address_of(url):
    """The address as it is typed, with or without `http://`."""
    url = url.strip().rstrip("/")
    url = url if "://" in url else f"http://{url}"
    parts = urllib.parse.urlsplit(url)
    if parts.scheme not in ("http", "https"):
        raise ValueError("http and https are spoken here")
    if not parts.hostname or parts.port == 0:  # `port` itself raises where no port can be such
        raise ValueError("it names no host and port")
    return url


def opener_for(host):
    """Opens addresses of this host; this machine is reached without a proxy."""
    name = urllib.parse.urlsplit(f"//{host}").hostname
    is_loopback = name in ("localhost", "::1") or name.startswith("127.")
    return urllib.request.build_opener(urllib.request.ProxyHandler({} if is_loopback else None))


def key_of(environment):
    """The key, which no message may tell."""
    key = environment.get("TOOTHWAVE_KEY", "").strip()
    if not (key.isascii() and " " not in key and key.isprintable()):
        raise ValueError("the key in TOOTHWAVE_KEY has blanks or letters that no key has")
    return key


def pause_of(retry_after):
    """`Retry-After` in seconds, five at most: it may be a number or a date."""
    try:
        pause_s = float(retry_after)
    except (TypeError, ValueError):
        try:
            pause_s = email.utils.parsedate_to_datetime(retry_after).timestamp() - time.time()
        except (TypeError, ValueError, OverflowError):
            pause_s = 1.0
    return min(max(0.0, pause_s), 5.0)


def objection(url, error):
    """What the service objects to, in its own words."""
    try:
        problem = json.load(error)
        faults = [f"{fault['pointer']}: {fault['detail']}" for fault in problem.get("errors", [])]
        text = "\n".join([problem["title"], *(faults or [problem["detail"]])])
    except (OSError, ValueError, KeyError, TypeError, AttributeError, http.client.HTTPException):
        no_service(url, f"HTTP status {error.code}")
    raise SystemExit(text)


def no_service(url, reason):
    raise SystemExit(f"No toothwave service answers at {url}: {reason or type(reason).__name__}")


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
        assembly = drawing(url, {**design, "assembly": {"input_angle_deg": input_angle_deg}})
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

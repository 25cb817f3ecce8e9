"""Calls to a toothwave service. Python's standard library only, so that it can be tried without FreeCAD."""

import json
import os
import time
import urllib.error
import urllib.request
from collections import OrderedDict

KEPT_ANSWERS = 32  # of each endpoint; an assembly has some 150 kB
ATTEMPTS = 4  # where the service is full
LONGEST_PAUSE_S = 5.0


class Problem(Exception):
    """What the service says when it has no answer, in its own words (RFC 9457)."""

    def __init__(self, status, document):
        self.status = status
        self.title = document.get("title") or f"HTTP status {status}"
        self.detail = document.get("detail", "")
        self.errors = document.get("errors", [])
        super().__init__(self.text())

    def text(self):
        """The title, then each field at fault, or where there is none the detail, which else repeats them."""
        lines = [f"{error['pointer']}: {error['detail']}" for error in self.errors] or [self.detail]
        return "\n".join([self.title, *lines]).strip()


class NoService(Exception):
    """Nothing that answers like a toothwave service stands at the address."""


class Service:
    """A service, and the answers that it gave.

    An answer depends only on what its endpoint reads of the document, and its entity tag is a hash of just that. So the tags
    of all answers kept are sent along: after a change elsewhere in the document the service says which one still holds, and
    nothing is solved or sent again.
    """

    def __init__(self, url, timeout_s=30.0):
        self.url = url.rstrip("/")
        self.timeout_s = timeout_s
        self._answers = {}  # path -> {entity tag: answer}, the latest used last

    def drawing(self, part, document):
        """The sections of `ring`, `wave-generator`, `carrier` or `tooth`, or of all of them in place: `assembly`."""
        return self._solve(f"/v1/drawings/{part}", document)

    def sweep(self, document):
        """Forces and stresses over a period, peaks and findings."""
        return self._solve("/v1/sweep", document)

    def examples(self):
        """Names of ready design documents."""
        return [example["name"] for example in self._send(urllib.request.Request(self.url + "/v1/examples"))[1]["examples"]]

    def example(self, name):
        """A ready design document."""
        return self._send(urllib.request.Request(f"{self.url}/v1/examples/{name}"))[1]

    def _solve(self, path, document):
        answers = self._answers.setdefault(path, OrderedDict())
        headers = {"Content-Type": "application/json", "Accept": "application/json"}
        if answers:
            headers["If-None-Match"] = ", ".join(answers)
        body = json.dumps(document).encode()
        tag, answer = self._send(urllib.request.Request(self.url + path, body, headers))
        if answer is not None:
            answers[tag] = answer
        answers.move_to_end(tag)
        while len(answers) > KEPT_ANSWERS:
            answers.popitem(last=False)
        return answers[tag]

    def _send(self, request):
        """Entity tag and answer, which is None where the one with this tag still holds."""
        if key := os.environ.get("TOOTHWAVE_KEY"):  # of a service that wants one; never a property, so that no document carries it
            request.add_header("Authorization", f"Bearer {key}")
        for left in reversed(range(ATTEMPTS)):
            try:
                with urllib.request.urlopen(request, timeout=self.timeout_s) as response:
                    return response.headers["ETag"], json.load(response)
            except urllib.error.HTTPError as error:
                if error.code == 304:
                    return error.headers["ETag"], None
                if error.code in (502, 503, 504) and left:
                    time.sleep(min(float(error.headers.get("Retry-After", 1)), LONGEST_PAUSE_S))
                    continue
                raise self._problem(error) from None
            except (OSError, ValueError) as error:
                reason = getattr(error, "reason", error)
                raise NoService(f"No toothwave service answers at {self.url}: {reason}") from None

    def _problem(self, error):
        try:
            return Problem(error.code, json.load(error))
        except (ValueError, AttributeError):
            return NoService(f"{self.url} answers {error.code} {error.reason}, and not as a toothwave service does")

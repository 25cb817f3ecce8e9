"""Calls to a toothwave service. Python's standard library only, so that it can be tried without FreeCAD."""

import email.utils
import http.client
import json
import os
import time
import urllib.error
import urllib.parse
import urllib.request
from collections import OrderedDict

KEPT_ANSWERS = 32  # of each endpoint; an assembly has some 150 kB
ATTEMPTS = 4  # where the service is full, or its replica is lost
PAUSE_S = 1.0  # where the service names none
LONGEST_PAUSE_S = 5.0

# A connection that was there and is no more. An answer that broke off was no answer, and every call may be repeated.
LOST = (ConnectionResetError, ConnectionAbortedError, BrokenPipeError, http.client.IncompleteRead)


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

    def __init__(self, url, timeout_s=30.0, wait=lambda call: call()):
        self.url = url
        self.timeout_s = timeout_s
        self._wait = wait  # makes a call and gives its result; a window goes on being drawn meanwhile
        self._answers = {}  # path -> {entity tag: answer}, the latest used last

    def drawing(self, part, document):
        """The sections of `ring`, `wave-generator`, `carrier` or `tooth`, or of all of them in place: `assembly`."""
        return self._solve(f"/v1/drawings/{part}", document, "bodies")

    def sweep(self, document):
        """Forces and stresses over a period, peaks and findings."""
        return self._solve("/v1/sweep", document, "peaks", "findings")

    def examples(self):
        """Names of ready design documents."""
        _, answer = self._call("/v1/examples", None, {}, "examples")
        return [example["name"] for example in answer["examples"]]

    def example(self, name):
        """A ready design document."""
        return self._call(f"/v1/examples/{urllib.parse.quote(name)}", None, {}, "drive")[1]

    def _solve(self, path, document, *members):
        answers = self._answers.setdefault(path, OrderedDict())
        body = json.dumps(document).encode()
        tag, answer = self._call(path, body, answers, *members)
        if tag is None:
            return answer
        if answer is not None:
            answers[tag] = answer
        answers.move_to_end(tag)
        while len(answers) > KEPT_ANSWERS:
            answers.popitem(last=False)
        return answers[tag]

    def _call(self, path, body, known, *members):
        """Entity tag and answer, which is None where the one with this tag still holds."""
        tag, answer = self._wait(lambda: self._send(path, body, known))
        if answer is None and tag not in known:
            if known:  # something on the way took another answer for one of ours
                return self._call(path, body, {}, *members)
            raise self._stranger("says that nothing has changed, of an answer that it never gave")
        if answer is not None and not (isinstance(answer, dict) and all(member in answer for member in members)):
            raise self._stranger("answers, but not as a toothwave service does")
        return tag, answer

    def _send(self, path, body, known):
        for left in reversed(range(ATTEMPTS)):
            try:
                request = self._request(path, body, known)
                with opener_for(request.host).open(request, timeout=self.timeout_s) as response:
                    return _strong(response.headers["ETag"]), json.load(response)
            except urllib.error.HTTPError as error:
                with error:
                    if error.code == 304:
                        return _strong(error.headers["ETag"]), None
                    if error.code not in (502, 503, 504) or not left:
                        raise self._problem(error) from None
                    pause_s = pause_of(error.headers["Retry-After"])
            # OverflowError: of a port that no port can be.
            except (OSError, ValueError, OverflowError, http.client.HTTPException) as error:
                reason = error.reason if isinstance(error, urllib.error.URLError) else error
                if not isinstance(reason, LOST) or not left:
                    reason = str(reason) or type(reason).__name__
                    raise NoService(f"No toothwave service answers at {self.url}: {reason}") from None
                pause_s = PAUSE_S
            time.sleep(pause_s)

    def _request(self, path, body, known):
        headers = {"Accept": "application/json"}
        if body is not None:
            headers["Content-Type"] = "application/json"
        if known:
            headers["If-None-Match"] = ", ".join(known)
        request = urllib.request.Request(address_of(self.url) + path, body, headers)
        # Of a service that wants one; never a property, so that no document carries it, and for this address alone.
        if key := os.environ.get("TOOTHWAVE_KEY", "").strip():
            if not (key.isascii() and key.isprintable() and " " not in key):
                raise ValueError("the key in TOOTHWAVE_KEY has blanks or letters that no key has")
            request.add_unredirected_header("Authorization", f"Bearer {key}")
        return request

    def _problem(self, error):
        try:
            return Problem(error.code, json.load(error))
        except (OSError, ValueError, AttributeError, KeyError, TypeError, http.client.HTTPException):
            return self._stranger(f"answers {error.code} {error.reason}, and not as a toothwave service does")

    def _stranger(self, what):
        return NoService(f"{self.url} {what}")


def address_of(text):
    """An address as it is typed, `http://` left out or not. Raises ValueError where it can be none."""
    address = text.strip()
    if not address:
        raise ValueError("the address is empty")
    if any(character.isspace() for character in address):
        raise ValueError("an address has no blanks")
    if "://" not in address:
        address = f"http://{address}"
    parts = urllib.parse.urlsplit(address)
    if parts.scheme not in ("http", "https"):
        raise ValueError(f"{parts.scheme} is not spoken here, http and https are")
    if not parts.hostname or parts.port == 0:  # `port` itself raises where it is no number, or beyond 65535
        raise ValueError("it names no host and port, such as 127.0.0.1:8080")
    return address.rstrip("/")


def opener_for(host):
    """Opens addresses of this host. This machine is reached without a proxy, whatever `http_proxy` says."""
    name = urllib.parse.urlsplit(f"//{host}").hostname
    is_loopback = name in ("localhost", "::1") or name.startswith("127.")
    return urllib.request.build_opener(urllib.request.ProxyHandler({} if is_loopback else None))


def pause_of(retry_after):
    """How long to wait, as the header `Retry-After` says it: in seconds, or by a date."""
    text = (retry_after or "").strip()
    if text.isascii() and text.isdigit():
        return min(float(text), LONGEST_PAUSE_S)
    try:
        until_s = email.utils.parsedate_to_datetime(text).timestamp()
    except (TypeError, ValueError, OverflowError):
        return PAUSE_S
    return min(max(until_s - time.time(), 0.0), LONGEST_PAUSE_S)


def _strong(tag):
    """An entity tag without the mark that a proxy sets when it has compressed the answer."""
    return tag[2:] if tag and tag.startswith("W/") else tag

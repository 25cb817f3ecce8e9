"""Checks the documentation: length of sentences, number of words, links. tests/docs/check.py [--verbose]

Code blocks do not count. A code span is one word. A sentence in a cell of a table has the same limit, and is not part of the mean. Pages
that tests/docs/generate.py writes are counted apart. Links are checked in every text, sentences in those for users.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MEAN_WORDS, MOST_WORDS = 16, 40  # of a sentence
README_WORDS, DOCS_WORDS, DOCS_WITHOUT_PROOFS_WORDS = 900, 38_000, 14_000
PROOFS = {"docs/explanation/theory.md", "docs/explanation/validation.md"}
FREE_SENTENCES = {"docs/explanation/theory.md"}
FOR_USERS = ("README.md", "SECURITY.md", "CHANGELOG.md", "docs/", "clients/")
GENERATED = "<!-- Written by "
LABEL = re.compile(r"^\*\*[^*]{1,40}[.:]\*\*[.:]?\s*")
SOURCES = {".css", ".html", ".js", ".json", ".md", ".py", ".rs", ".toml", ".yaml", ".conf", ""}
NOT_OURS = {"target", ".git", "node_modules"}

LINK = re.compile(r"!?\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^()\s]+)\)")
LIST_ITEM = re.compile(r"\s*(?:[-*+]|\d+\.)\s+")
BULLET = re.compile(r"\s*[-*+]\s+")
SENTENCE_END = re.compile(r"(?<=[.!?。！？])[\"')*_]*\s+(?=[\"'(*_`\[]*[^\sa-z])")
NOT_AN_END = re.compile(r"\b(?:e\.g|i\.e|vs|cf|Fig|No|doi|[A-Z])\.$")


def pages():
    """All texts by their path from the root."""
    files = sorted(file for file in ROOT.rglob("*.md") if not NOT_OURS & set(file.relative_to(ROOT).parts))
    return {file.relative_to(ROOT).as_posix(): file.read_text(encoding="utf-8") for file in files}


def blocks(text):
    """Pieces of text outside of code: (kind, text), with kind `prose`, `cell` or `heading`."""
    prose, in_fence, in_list, after_blank = [], False, False, True

    def flush():
        if prose:
            yield "prose", " ".join(prose)
            prose.clear()

    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            in_fence = not in_fence
            yield from flush()
        elif in_fence or (line.startswith("    ") and after_blank and not LIST_ITEM.match(line)):
            continue
        elif not line.strip() or re.fullmatch(r"[\s|:-]+", line):
            yield from flush()
            after_blank = True
            continue
        elif line.startswith("#"):
            yield from flush()
            yield "heading", line.lstrip("# ")
        elif line.startswith("|"):
            yield from flush()
            for cell in re.split(r"(?<!\\)\|", line.strip().strip("|")):
                yield "cell", cell.strip()
        else:
            # A number at the start of a line begins an item only after a blank line or another item.
            if BULLET.match(line) or (LIST_ITEM.match(line) and (not prose or in_list)):
                yield from flush()
                in_list = True
                line = LIST_ITEM.sub("", line, count=1)
            elif not prose:
                in_list = False
            prose.append(line.strip())
        after_blank = False
    yield from flush()


def plain(text):
    """Text without markup: a code span is one word, a link its text."""
    text = re.sub(r"`[^`]*`", "`code`", text)
    return LINK.sub(r"\1", text)


def words(text):
    return sum(1 for word in text.split() if any(character.isalnum() for character in word))


def sentences(text):
    parts = []
    for part in SENTENCE_END.split(plain(LABEL.sub("", text))):
        if parts and NOT_AN_END.search(parts[-1]):
            parts[-1] += " " + part
        else:
            parts.append(part)
    return [part for part in parts if words(part)]


def anchors(text):
    """The anchors that GitHub gives to headings."""
    found = {}
    for kind, heading in blocks(text):
        if kind == "heading":
            name = re.sub(r"[^\w\- ]", "", LINK.sub(r"\1", heading).replace("`", "").lower()).replace(" ", "-")
            found[name] = found.get(name, -1) + 1
    return {name if not number else f"{name}-{number}" for name, last in found.items() for number in range(last + 1)}


def broken_links(name, texts):
    text = re.sub(r"```.*?```", "", texts[name], flags=re.DOTALL)
    for _, target in LINK.findall(re.sub(r"`[^`\n]*`", "", text)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = ((ROOT / name).parent / path).resolve() if path else ROOT / name
        if not file.exists():
            yield f"{name}: no file {target}"
        elif anchor and file.suffix == ".md" and anchor not in anchors(texts[file.relative_to(ROOT).as_posix()]):
            yield f"{name}: no heading {target}"


def broken_mentions():
    """Paths such as docs/….md that code and texts name as words."""
    for file in sorted(ROOT.rglob("*")):
        parts = file.relative_to(ROOT).parts
        if NOT_OURS & set(parts) or not file.is_file() or file.suffix not in SOURCES or file == Path(__file__).resolve():
            continue
        try:
            text = file.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        for path in sorted(set(re.findall(r"(?<![\w/.])docs/[\w./-]+\.(?:md|svg|png)\b", text))):
            if not (ROOT / path).exists():
                yield f"{'/'.join(parts)}: names {path}, which is not there"


def main(verbose):
    texts, faults = pages(), []
    lengths, counts = [], {}
    for name, text in texts.items():
        faults += broken_links(name, texts)
        if not name.startswith(FOR_USERS):
            continue
        counts[name], own = 0, []
        for kind, block in blocks(text):
            counts[name] += words(plain(block))
            for sentence in sentences(block) if kind != "heading" and name not in FREE_SENTENCES else []:
                length = words(sentence)
                if kind == "prose":
                    own.append(length)
                if length > MOST_WORDS:
                    faults.append(f"{name}: {length} words: {sentence[:90]}…")
        lengths += own
        if verbose:
            print(f"{name}: {counts[name]} words" + (f", {sum(own) / len(own):.1f} a sentence, the longest {max(own)}" if own else ""))
    faults += broken_mentions()
    docs = {name: count for name, count in counts.items() if name.startswith("docs/") and GENERATED not in texts[name]}
    limits = [
        (sum(lengths) / len(lengths), MEAN_WORDS, "words a sentence in the mean"),
        (counts["README.md"], README_WORDS, "words in README.md"),
        (sum(docs.values()), DOCS_WORDS, "words in docs/"),
        (sum(count for name, count in docs.items() if name not in PROOFS), DOCS_WITHOUT_PROOFS_WORDS, "of these without theory and validation"),
    ]
    for count, most, what in limits:
        print(f"{count:6.5g} {what}, at most {most}")
        if count > most:
            faults.append(f"{count:.5g} {what}, more than {most}")
    generated = sum(count for name, count in counts.items() if name.startswith("docs/") and GENERATED in texts[name])
    print(f"{generated:6} words in pages that follow from the code")
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main("--verbose" in sys.argv[1:])

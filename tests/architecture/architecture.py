"""Checks of the source tree that no compiler makes: direction of includes, forbidden words, sizes, READMEs.

The rules are data in rooms.toml. `check(root, rules)` returns findings; `python3 architecture.py [ROOT]` prints them.
"""

import os
import re
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

CODE = {".hpp", ".cpp"}
TEXT = CODE | {".py", ".ts", ".js", ".html", ".css", ".cmake", ".toml", ".md", ".txt", ".sh", ".json", ""}
SKIPPED_FOLDERS = {"build", "node_modules", "__pycache__"}
DATA_FOLDERS = ("tests/fuzz/corpus", "tools/demo")
INCLUDE = re.compile(r'^\s*#\s*include\s*(["<])([^">]+)[">]')
# Comments, string and character literals; the literal's quotes stay so that the code keeps its shape.
COMMENT_OR_LITERAL = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"([^()\\ ]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])*\'', re.DOTALL
)
MACHINE_PATH = re.compile(r"(?<![\w.`*})$%/-])/(?:work|home|root)/\w")
MARKDOWN_LINK = re.compile(r"\[[^\]]*\]\(([^)#\s]+)(?:#[^)]*)?\)")


@dataclass(frozen=True)
class Finding:
    file: str
    line: int
    rule: str
    text: str

    def __str__(self):
        return f"{self.file}:{self.line}: {self.rule}: {self.text}"


def load_rules(path):
    with open(path, "rb") as file:
        return tomllib.load(file)


def list_files(root):
    """All files of the tree, relative, sorted; without build folders and hidden folders except .ci."""
    files = []
    for folder, subfolders, names in os.walk(root):
        subfolders[:] = sorted(
            name for name in subfolders if name not in SKIPPED_FOLDERS and (not name.startswith(".") or name == ".ci")
        )
        files += [Path(folder, name).relative_to(root).as_posix() for name in names if name != ".git"]
    return sorted(files)


def is_below(path, folder):
    return path == folder or path.startswith(folder + "/")


def room_of(path, rooms):
    """The longest room that holds the file, or None."""
    holders = [room for room in rooms if is_below(str(PurePosixPath(path).parent), room)]
    return max(holders, key=len, default=None)


def without_comments(text):
    """The code alone; line numbers stay."""

    def blank(match):
        newlines = "\n" * match.group().count("\n")
        return newlines if match.group().startswith("/") else '""' + newlines

    return COMMENT_OR_LITERAL.sub(blank, text)


def includes_of(text):
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        if match:
            yield number, match.group(1) == '"', match.group(2)


def check_our_include(root, path, number, target, rooms):
    owner, used = room_of(path, rooms), room_of(target, rooms)
    if not (root / target).is_file() and not target.startswith("generated/"):
        yield Finding(path, number, "include paths start at the repository root", target)
    elif owner is None or used is None:
        yield Finding(path, number, "folder is not a room in rooms.toml", path if owner is None else target)
    elif used != owner and used not in rooms[owner] and (rooms[owner] != ["*"] or used == "tests" != owner):
        yield Finding(path, number, f"forbidden arrow {owner} -> {used}", target)


def check_foreign_include(path, number, target, rules):
    if any(target.startswith(name) for name in rules["everywhere"]["forbidden"]):
        yield Finding(path, number, "header that never enters the firmware", target)
        return
    headers = rules["headers"]
    is_exempt = any(is_below(path, folder) for folder in headers["exempt"])
    if path.endswith(".hpp") and not is_exempt and target not in headers["allowed"]:
        if any(target.startswith(name) for name in headers["forbidden"]):
            yield Finding(path, number, "heavy header in a header of ours; move it to the .cpp", target)


def check_includes(root, path, text, rules):
    for number, is_ours, target in includes_of(text):
        if is_ours and not target.startswith("hwy/"):
            yield from check_our_include(root, path, number, target, rules["rooms"])
        else:
            yield from check_foreign_include(path, number, target, rules)


def is_excepted(path, rule, rules):
    return any(e["file"] == path and rule.startswith(e["rule"]) for e in rules.get("exceptions", []))


def check_tokens(path, text, rules):
    # Include lines keep their <>: only comments and literals are blanked.
    lines = without_comments(text).splitlines()
    for entry in rules["tokens"]:
        if not any(is_below(path, room) for room in entry["rooms"]) or is_excepted(path, entry["rule"], rules):
            continue
        if entry.get("headers_only") and not path.endswith(".hpp"):
            continue
        pattern = re.compile(entry["pattern"])
        for number, line in enumerate(lines, 1):
            match = pattern.search(line)
            if match:
                yield Finding(path, number, entry["rule"], match.group())


def check_code(root, path, text, rules):
    yield from check_includes(root, path, text, rules)
    yield from check_tokens(path, text, rules)
    if path.endswith(".hpp") and "#pragma once" not in text:
        yield Finding(path, 1, "a header begins with #pragma once", "")
    if PurePosixPath(path).name != PurePosixPath(path).name.lower():
        yield Finding(path, 1, "file names are snake_case", "")


def check_text(root, path, text, rules):
    lines = text.splitlines()
    limit = rules["files"]["max_lines"]
    suffix = PurePosixPath(path).suffix
    if suffix in CODE | {".py", ".ts", ".js"} and len(lines) > limit and path not in rules["files"]["longer"]:
        yield Finding(path, limit, f"a file has at most {limit} lines", f"{len(lines)} lines")
    for number, line in enumerate(lines, 1):
        match = MACHINE_PATH.search(line)
        if match:
            yield Finding(path, number, "path of one machine", match.group())
    if suffix == ".md":
        for number, line in enumerate(lines, 1):
            for target in MARKDOWN_LINK.findall(line):
                if "://" not in target and not (root / PurePosixPath(path).parent / target).exists():
                    yield Finding(path, number, "link to a file that is not there", target)


def folders_with_files(files):
    return sorted({str(PurePosixPath(path).parent) for path in files})


def check_folders(files, rules):
    """Each room and each folder of tools and tests has a README."""
    existing = set(files)
    for folder in folders_with_files(files):
        is_house = any(is_below(folder, top) for top in ("drivers", "firmware", "sfm", "tools", "tests"))
        # Unit tests mirror the tree; sources of a web page are explained beside its package.json; data explains itself.
        mirrors = is_below(folder, "tests/unit") or "src" in PurePosixPath(folder).parts
        mirrors = mirrors or any(is_below(folder, data) for data in DATA_FOLDERS)
        holds_code = any(
            str(PurePosixPath(path).parent) == folder and PurePosixPath(path).name not in ("CMakeLists.txt", "README.md")
            for path in files
        )
        if is_house and not mirrors and holds_code and f"{folder}/README.md" not in existing:
            yield Finding(folder, 1, "a folder has a README.md that says what it is for", "")
    for room in rules["rooms"]:
        if not any(is_below(path, room) for path in files):
            yield Finding("tests/architecture/rooms.toml", 1, "room that does not exist", room)


def check(root, rules):
    """All findings in the tree below `root`."""
    root = Path(root)
    files = list_files(root)
    findings = list(check_folders(files, rules))
    for path in files:
        suffix = PurePosixPath(path).suffix
        if suffix not in TEXT or any(is_below(path, data) for data in DATA_FOLDERS):
            continue
        try:
            text = (root / path).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            findings.append(Finding(path, 1, "text files are UTF-8", ""))
            continue
        findings += check_text(root, path, text, rules)
        if suffix in CODE:
            findings += check_code(root, path, text, rules)
    return findings


def main():
    here = Path(__file__).resolve().parent
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else here.parents[1]
    findings = check(root, load_rules(here / "rooms.toml"))
    for finding in findings:
        print(finding)
    print(f"architecture: {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Runs every ```sh block of a document, in order and in one shell session's environment, and puts what it
printed into the ```text block that follows. Stops at the first command that fails.
usage: run_document.py DOCUMENT.md"""
import pathlib
import re
import subprocess
import sys

BLOCK = re.compile(r"```sh\n(.*?)```\n(?:\n```text\n(.*?)```\n)?", re.S)


def main():
    path = pathlib.Path(sys.argv[1])
    text = path.read_text(encoding="utf-8")
    before = []  # earlier exports count in later blocks

    def run(match):
        commands = match.group(1)
        shell = "set -euo pipefail\n" + "".join(before) + commands
        before.extend(line + "\n" for line in commands.splitlines() if line.startswith("export "))
        done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(f"{path}: this block failed:\n{commands}{done.stdout}{done.stderr}")
        if match.group(2) is None:
            return match.group(0)
        return f"```sh\n{commands}```\n\n```text\n{done.stdout.strip(chr(10))}\n```\n"

    path.write_text(BLOCK.sub(run, text), encoding="utf-8")


main()

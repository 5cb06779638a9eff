"""Holds licences and sources of the crates that `cargo metadata` lists on standard input to a deny.toml."""

import json
import re
import sys
import tomllib


def is_allowed(expression: str, allowed: set[str]) -> bool:
    """Whether an SPDX expression (or the older form with slashes) can be met by licences of `allowed`."""
    words = re.findall(r"\(|\)|[^\s()]+", expression.replace("/", " OR "))

    def either() -> bool:
        met = both()
        while words and words[0] == "OR":
            words.pop(0)
            met = both() or met
        return met

    def both() -> bool:
        met = one()
        while words and words[0] == "AND":
            words.pop(0)
            met = one() and met
        return met

    def one() -> bool:
        word = words.pop(0)
        if word == "(":
            met = either()
            words.pop(0)
            return met
        if words and words[0] == "WITH":
            word += f" WITH {words[1]}"
            del words[:2]
        return word in allowed

    return either()


def faults(packages: list[dict], deny: dict) -> list[str]:
    """What is wrong with the packages, a line each."""
    allowed = set(deny["licenses"]["allow"])
    registries = {f"registry+{url}" for url in deny["sources"]["allow-registry"]}
    found = []
    for package in packages:
        name = f"{package['name']} {package['version']}"
        licence = package["license"]
        if not licence or not is_allowed(licence, allowed):
            found.append(f"{name}: licence {licence!r} is not among those that deny.toml allows")
        # without a source it is a crate of this repository
        if package["source"] is not None and package["source"] not in registries:
            found.append(f"{name}: source {package['source']} is not among those that deny.toml allows")
    return found


def main() -> None:
    with open(sys.argv[1], "rb") as file:
        deny = tomllib.load(file)
    packages = json.load(sys.stdin)["packages"]
    wrong = faults(packages, deny)
    for line in wrong:
        print(line, file=sys.stderr)
    if wrong:
        sys.exit(1)
    print(f"{len(packages)} crates, each of a licence and a source that deny.toml allows")


if __name__ == "__main__":
    main()

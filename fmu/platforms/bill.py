"""Writes the software bill of materials of a packed FMU: CycloneDX 1.5, JSON.

python3 fmu/platforms/bill.py HysteresisContact.fmu > HysteresisContact.cdx.json

Names what is compiled into each library: the crate, which depends on no other; Rust's standard library with the crates
inside it, as its archives in the sysroot name them; the C runtime linked in. Same FMU and same tools, same bytes: it
carries no time, and its serial number comes from the FMU's sum.
"""

import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import uuid
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MIT_OR_APACHE = "MIT OR Apache-2.0"
# licences of what rustc's standard library brings, as each crate's own manifest declares them
LICENCES = {
    "addr2line": "Apache-2.0 OR MIT",
    "adler": "0BSD OR MIT OR Apache-2.0",
    "miniz_oxide": "MIT OR Zlib OR Apache-2.0",
    "memchr": "Unlicense OR MIT",
}
# Debian's name of the compiler whose C runtime a library takes in
MINGW = {"win64": "x86-64", "win32": "i686"}
# archives in the sysroot that a plain library does not take in
NOT_LINKED = {"getopts", "panic_abort", "proc_macro", "test", "unicode_width"}


def said(*command):
    """First line that a command prints."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[0].strip()


def debian(package):
    """Version of an installed package."""
    return said("dpkg-query", "-W", "-f", "${Version}\n", package)


def standard_library(rustc):
    """(name, version or None) of the crates beside std in rustc's sysroot."""
    folder = pathlib.Path(said(rustc, "--print", "target-libdir"))
    archives = sorted(folder.glob("lib*.rlib"))
    versions = {}
    for a in archives:
        for name, version in re.findall(rb"vendor/([a-z0-9_-]+)-(\d[0-9.]*\d)/", a.read_bytes()):
            versions[name.decode().replace("-", "_")] = version.decode()
    own = {"alloc", "core", "panic_unwind", "std", "std_detect", "unwind"}
    names = {a.name[3:].rsplit("-", 1)[0] for a in archives} - own - NOT_LINKED
    return [(n, versions.get(n)) for n in sorted(names) if not n.startswith("rustc_std_workspace")]


def component(reference, name, version, licence, **more):
    c = {"type": "library", "bom-ref": reference, "name": name}
    if version:
        c["version"] = version
    return {**c, "licenses": [{"expression": licence}], **more}


def sum_of(data):
    return [{"alg": "SHA-256", "content": hashlib.sha256(data).hexdigest()}]


def bill(fmu):
    """The bill as a tree ready for JSON."""
    data = pathlib.Path(fmu).read_bytes()
    rustc = os.environ.get("TOUCHDOWN_RUSTC", "/usr/bin/rustc")
    rust = said(rustc, "--version").split()[1]
    zig = re.search(r"ziglang==(\S+)", (ROOT / "fmu/platforms/requirements.txt").read_text())[1]
    version = re.search(r'^version = "(.+)"', (ROOT / "fmu/element/Cargo.toml").read_text(), re.M)[1]
    components = [component("crate", "touchdown-fmu", version, "MIT", purl=f"pkg:cargo/touchdown-fmu@{version}")]
    components.append(component("std", "rust-std", rust, MIT_OR_APACHE))
    inside = []
    for name, at in standard_library(rustc):
        licence = LICENCES.get(name, MIT_OR_APACHE)
        purl = {"purl": f"pkg:cargo/{name}@{at}"} if at else {}
        components.append(component(f"std/{name}", name, at, licence, **purl))
        inside.append(f"std/{name}")
    depends = {"fmu": [], "crate": ["std"], "std": inside}
    tools = [
        {"type": "application", "name": "rustc", "version": rust},
        {"type": "application", "name": "zig", "version": zig},
    ]
    with zipfile.ZipFile(fmu) as z:
        for path in sorted(n for n in z.namelist() if n.startswith("binaries/") and not n.endswith("/")):
            platform = path.split("/")[1]
            depends["fmu"].append(path)
            components.append(component(path, path, version, "MIT", hashes=sum_of(z.read(path))))
            linked = ["crate"]
            if platform == "linux64":
                components.append(component("libunwind", "LLVM libunwind", None, "Apache-2.0 WITH LLVM-exception",
                                            description=f"as zig {zig} carries it"))
                linked.append("libunwind")
            elif platform in MINGW:
                family = MINGW[platform]
                compiler = debian(f"gcc-mingw-w64-{family}-posix")
                tools.append({"type": "application", "name": f"gcc-mingw-w64-{family}-posix", "version": compiler})
                runtime, gcc = f"{platform}/mingw-w64", f"{platform}/libgcc"
                components.append(component(runtime, "mingw-w64", debian(f"mingw-w64-{family}-dev"), "ZPL-2.1"))
                components.append(component(gcc, "libgcc", compiler, "GPL-3.0-or-later WITH GCC-exception-3.1"))
                linked += [runtime, gcc]
            depends[path] = linked
    components.sort(key=lambda c: c["bom-ref"])
    for c in components:
        depends.setdefault(c["bom-ref"], [])
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_OID, hashlib.sha256(data).hexdigest())}",
        "version": 1,
        "metadata": {
            "tools": {"components": tools},
            "component": component("fmu", "HysteresisContact", version, "MIT", hashes=sum_of(data)),
        },
        "components": components,
        "dependencies": [{"ref": r, "dependsOn": sorted(d)} for r, d in sorted(depends.items())],
    }


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("bill.py FMU: give the packed FMU")
    json.dump(bill(sys.argv[1]), sys.stdout, indent=2)
    print()

# Sourced with $root set. Keeps what the build and the tests need from Python in target/venv.

# python_needs FILE...: makes target/venv where it is absent and installs what the requirement files list.
python_needs() {
    if [ ! -x "$root/target/venv/bin/pip" ]; then
        mkdir -p "$root/target"
        echo "setting up target/venv" >&2
        python3 -m venv "$root/target/venv" || {
            echo "python3 -m venv failed: install Debian's python3-venv" >&2
            exit 2
        }
    fi
    for needs in "$@"; do
        stamp="$root/target/venv/$(cksum < "$needs" | tr ' ' -).ok"
        if [ ! -e "$stamp" ]; then
            echo "installing $needs into target/venv" >&2
            "$root/target/venv/bin/pip" install --quiet --disable-pip-version-check -r "$needs"
            touch "$stamp"
        fi
    done
}

# libclang: a build dependency generates its bindings with it.
if [ -z "${LIBCLANG_PATH:-}" ]; then
    python_needs "$root/harness/requirements.txt"
    LIBCLANG_PATH=$("$root/target/venv/bin/python" -c 'import clang, os; print(os.path.join(os.path.dirname(clang.__file__), "native"))')
    BINDGEN_EXTRA_CLANG_ARGS="-I$(cc -print-file-name=include)"
    export LIBCLANG_PATH BINDGEN_EXTRA_CLANG_ARGS
fi

# Sourced with $root set: brings libclang, which a build dependency generates its bindings with, into target/.
if [ -z "${LIBCLANG_PATH:-}" ]; then
    if [ ! -e "$root/target/venv/libclang.ok" ]; then
        mkdir -p "$root/target"
        echo "setting up target/venv" >&2
        python3 -m venv "$root/target/venv" || {
            echo "python3 -m venv failed: install Debian's python3-venv" >&2
            exit 2
        }
        "$root/target/venv/bin/pip" install --quiet --disable-pip-version-check 'libclang==18.1.1'
        touch "$root/target/venv/libclang.ok"
    fi
    LIBCLANG_PATH=$("$root/target/venv/bin/python" -c 'import clang, os; print(os.path.join(os.path.dirname(clang.__file__), "native"))')
    BINDGEN_EXTRA_CLANG_ARGS="-I$(cc -print-file-name=include)"
    export LIBCLANG_PATH BINDGEN_EXTRA_CLANG_ARGS
fi

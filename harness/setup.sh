# Sourced with $root set. Prints what is missing to build with, and keeps what the build and the tests need from Python in target/venv.

# The least Rust that the crates in Cargo.lock are built with.
rust_least=1.89

# install_with APT DNF BREW: the command of this system that installs a package.
install_with() {
    if command -v apt-get > /dev/null 2>&1; then
        echo "sudo apt-get install $1"
    elif command -v dnf > /dev/null 2>&1; then
        echo "sudo dnf install $2"
    elif command -v brew > /dev/null 2>&1; then
        echo "brew install $3"
    else
        echo "install $1 with your system's package manager"
    fi
}

# install_rust: the command that installs Rust. The one of most systems is older than what is needed.
install_rust() {
    if [ -x "${HOME:-}/.cargo/bin/cargo" ]; then
        echo "it is installed, but not in this shell's PATH: . \"\$HOME/.cargo/env\""
    elif command -v wget > /dev/null 2>&1 && ! command -v curl > /dev/null 2>&1; then
        echo "wget -qO- https://sh.rustup.rs | sh    # then: . \"\$HOME/.cargo/env\""
    else
        echo "curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh    # then: . \"\$HOME/.cargo/env\""
    fi
}

# old_rust: the version of a Rust that is too old; nothing where it is new enough.
old_rust() {
    said=$(rustc --version 2> /dev/null || true)
    version=${said#rustc }
    version=${version%% *}
    minor=${version#*.}
    minor=${minor%%.*}
    case $minor in
        '' | *[!0-9]*) ;;
        *) [ "${version%%.*}" -gt "${rust_least%.*}" ] || [ "$minor" -ge "${rust_least#*.}" ] || echo "$version" ;;
    esac
}

# lacks WHAT COMMAND: notes that WHAT is missing and that COMMAND installs it.
lacks() {
    missing="${missing}  $1
      $2
"
}

# tools_needed: ends with code 2 where a tool is missing that the build needs, and prints all of them.
tools_needed() {
    missing=
    if ! command -v cargo > /dev/null 2>&1; then
        lacks "Rust $rust_least or newer (cargo)" "$(install_rust)"
    elif [ -n "$(old_rust)" ]; then
        update=$(command -v rustup > /dev/null 2>&1 && echo "rustup update stable" || install_rust)
        lacks "Rust $rust_least or newer (here is $(old_rust))" "$update"
    fi
    command -v cc > /dev/null 2>&1 || lacks "a C compiler (cc)" "$(install_with 'gcc libc6-dev' gcc gcc)"
    if [ -z "${LIBCLANG_PATH:-}" ] && [ ! -x "$root/target/venv/bin/pip" ]; then
        has='import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))'
        python3 -c "$has" > /dev/null 2>&1 ||
            lacks "Python 3.11 or newer with venv (python3)" "$(install_with 'python3 python3-venv' python3 python3)"
    fi
    if [ -n "$missing" ]; then
        printf 'touchdown is built from source. Missing:\n%s' "$missing" >&2
        exit 2
    fi
}
tools_needed

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

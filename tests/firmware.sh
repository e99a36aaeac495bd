# Builds of firmware: a part of tests/run, which defines `run` and `need`.

# The board's target, and all targets on which fits are tested.
target=thumbv7em-none-eabihf
targets=("$target" thumbv8m.main-none-eabihf thumbv7em-none-eabi thumbv6m-none-eabi riscv32imc-unknown-none-elf)
wasm=wasm32-unknown-unknown
# The build directory of the firmware's compiler.
firmware_target="$PWD/embedded-demo/target"
built_wasm="$firmware_target/$wasm/release/glimpse_view.wasm"

# Succeeds if rustc has all targets.
has_targets() {
    local triple
    for triple in "${targets[@]}" "$wasm"; do
        [ -d "$(rustc --print sysroot)/lib/rustlib/$triple" ] || return 1
    done
}

# Sets `firmware_cargo`, a cargo command with the firmware's targets, `firmware_clippy` and `build_std`. Builds run with
# `nice`, because tests run at the same time.
find_compiler() {
    local triple environment
    firmware_cargo=(nice cargo)
    firmware_clippy=(cargo clippy)
    build_std=()
    if has_targets || { run timeout 300 rustup target add "${targets[@]}" "$wasm" && has_targets; }; then
        return
    fi
    printf "\n== rustup has no targets: using Debian's rustc, and building \`core\` from source\n"
    need /usr/bin/rustc:rustc-web /usr/share/doc/rust-web-src:rust-web-src /usr/bin/cargo-clippy:rust-web-clippy ld.lld:lld
    environment=(
        env RUSTC=/usr/bin/rustc
        RUSTC_BOOTSTRAP=1 # for -Zbuild-std, which stable refuses otherwise
        CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=wasm-ld
    )
    for triple in "${targets[@]}"; do
        environment+=("CARGO_TARGET_$(tr 'a-z.-' 'A-Z__' <<< "$triple")_LINKER=ld.lld")
    done
    firmware_cargo=(nice "${environment[@]}" cargo)
    # Debian's clippy, which matches the compiler's version.
    firmware_clippy=("${environment[@]}" /usr/bin/cargo-clippy clippy)
    build_std=(-Zbuild-std=core)
}

# firmware_build ARGUMENTS... builds in embedded-demo, which has its .cargo/config.toml.
firmware_build() {
    pushd embedded-demo > /dev/null
    run "${firmware_cargo[@]}" build --release --target-dir "$firmware_target" "${build_std[@]}" "$@"
    popd > /dev/null
}

# bench FEATURES NAME... builds fits with the given features for the board's target.
bench() {
    firmware_build -p glimpse-bench --no-default-features --features "$1" "${@:2}"
}

# The demo links only if it cannot panic, and so does `no-panic`, which calls all of core.
build_board() {
    firmware_build --features prove-no-panic
    bench libm,sgd,ridge --bin nothing --bin no-panic
    bench libm,sgd --bin phong --bin cook-torrance --bin neural
    bench libm,ridge --bin linear
    # The host program that prints the firmware's log.
    run nice cargo build --release --manifest-path tests/log/Cargo.toml
}

# Starts `build_board` in the background.
start_builds() {
    if [ -n "${builds:-}" ]; then
        return
    fi
    need qemu-system-arm:qemu-system-arm
    find_compiler
    builds_output=$(mktemp)
    set -m # a process group, which is killed as a whole if a test fails
    build_board > "$builds_output" 2>&1 < /dev/null &
    builds=$!
    set +m
    trap 'kill -- -$builds 2> /dev/null || true; rm -f "$builds_output"' EXIT
}

# Waits for the builds, and prints their output once.
finish_builds() {
    local failed=0
    wait "$builds" || failed=$?
    cat "$builds_output"
    : > "$builds_output"
    if [ "$failed" -ne 0 ]; then
        exit "$failed"
    fi
}

# Builds all fits of `FIT_BINARIES` in tests/src/figures.rs.
build_all_targets() {
    need qemu-system-riscv32:qemu-system-misc arm-none-eabi-objdump:binutils-arm-none-eabi
    local name models=(linear phong cook-torrance neural)
    local built="$firmware_target/$target/release" micromath="$firmware_target/micromath/$target"
    bench micromath,sgd,ridge --bin nothing --bin no-panic
    bench micromath,sgd --bin phong --bin cook-torrance --bin neural
    bench micromath,ridge --bin linear
    mkdir -p "$micromath"
    for name in nothing "${models[@]}"; do
        cp "$built/$name" "$micromath/$name"
    done
    build_board
    bench libm,sgd,ridge --bin any
    local completed=("${models[@]/%/-completed}")
    completed=("${completed[@]}" {linear,neural}-{masked,lost,n64} linear-basis)
    bench libm,ridge "${completed[@]/#/--bin=}"
    bench libm,ridge --bin nothing --bin neural-completed "${targets[@]/#/--target=}"
}

# Builds the WebAssembly module of the viewer at `$built_wasm`.
build_wasm() {
    run "${firmware_cargo[@]}" build --release --target-dir "$firmware_target" "${build_std[@]}" \
        --manifest-path trainer/viewer/wasm/Cargo.toml --target "$wasm"
}

# Builds the WebAssembly module and copies it to the trainer's sources.
wasm() {
    find_compiler
    build_wasm
    run cp --no-preserve=mode "$built_wasm" trainer/viewer/www/glimpse.wasm
}

# Lints of the firmware, of the benchmarks and of the WebAssembly module.
lint_firmware() {
    find_compiler
    local build=(--release --target-dir "$firmware_target" "${build_std[@]}")
    pushd embedded-demo > /dev/null
    run "${firmware_clippy[@]}" "${build[@]}" -p glimpse-embedded-demo -p glimpse-bench -- -D warnings
    popd > /dev/null
    run "${firmware_clippy[@]}" "${build[@]}" --manifest-path trainer/viewer/wasm/Cargo.toml --target "$wasm" \
        -- -D warnings
}

# The C library on microcontrollers: the proof that no function can panic, and the examples in QEMU.
capi_firmware() {
    need arm-none-eabi-gcc:gcc-arm-none-eabi ld.lld:lld /usr/lib/arm-none-eabi/newlib:libnewlib-arm-none-eabi
    # In the crate's directory, which has its .cargo/config.toml.
    pushd core/capi > /dev/null
    local triple build=(build --release --target-dir "$firmware_target" "${build_std[@]}")
    run "${firmware_cargo[@]}" "${build[@]}" --target "$target" --features prove-no-panic,can-panic
    if ! { capi_links "$target" glimpse_any_of_three 2>&1 || true; } | grep glimpse_can_panic; then
        printf 'the proof is invalid: a function that can panic links\n' >&2
        exit 1
    fi
    # With a floating-point unit and without one.
    local proven=("$target" thumbv6m-none-eabi)
    run "${firmware_cargo[@]}" "${build[@]}" "${proven[@]/#/--target=}" --features prove-no-panic
    for triple in "${proven[@]}"; do
        printf '\n== no function of the header can panic on %s\n' "$triple"
        capi_links "$triple" $(grep -oE '\bglimpse_[a-z_]+\(' include/glimpse.h | tr -d '(' | sort -u)
    done
    run cargo test --features qemu --test qemu
    popd > /dev/null
}

# capi_links TARGET FUNCTION... links functions of the library. The panic handler calls an undefined function, so
# linking fails if one of the functions can reach it: unreachable sections are removed before symbols are resolved.
capi_links() {
    local library=$firmware_target/$1/release/libglimpse.a function functions=()
    shift
    for function in "$@"; do
        functions+=(--undefined="$function")
    done
    ld.lld -m armelf --gc-sections --entry=glimpse_version "${functions[@]}" \
        --unresolved-symbols=report-all "$library" -o "$firmware_target/proof"
}

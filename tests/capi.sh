# The library for firmware in C. `tests/run` reads this file and calls its functions; `run`, `say`,
# `install` and what `find_compiler` sets are its.

# On the host: lints, the header, every function called as C would, the examples by cc.
capi_host() {
    pushd core/capi > /dev/null
    run cargo fmt --check
    run cargo clippy --all-targets -- -D warnings
    run cargo test
    local model
    for model in phong cook-torrance neural linear; do
        run cargo check --features "only-$model"
    done
    popd > /dev/null
}

# On microcontrollers, after `find_compiler`: the proof that nothing panics, for each target, and the
# examples in QEMU.
capi_firmware() {
    local program missing=()
    for program in arm-none-eabi-gcc:gcc-arm-none-eabi ld.lld:lld llvm-nm:llvm; do
        if ! command -v "${program%%:*}" > /dev/null; then
            missing+=("${program##*:}")
        fi
    done
    if [ ! -e /usr/lib/arm-none-eabi/newlib ] && [ ! -e /usr/arm-none-eabi/lib ]; then
        missing+=(libnewlib-arm-none-eabi)
    fi
    if [ "${#missing[@]}" -gt 0 ]; then
        install "${missing[@]}"
    fi
    # In its folder, where its .cargo/config.toml counts; the test looks for the libraries there.
    pushd core/capi > /dev/null
    local triple
    for triple in "${targets[@]}"; do
        run "${firmware_cargo[@]}" build --release --target-dir target "${build_std[@]}" \
            --target "$triple" --features prove-no-panic
        capi_prove "target/$triple/release/libglimpse.a"
    done
    run "${firmware_cargo[@]}" build --release --target-dir target "${build_std[@]}" \
        --target thumbv7em-none-eabihf
    # The smallest has 16 KiB of RAM.
    run env GLIMPSE_SAMPLES=8 GLIMPSE_COMPONENTS=5 "${firmware_cargo[@]}" build --release \
        --target-dir target "${build_std[@]}" --target thumbv6m-none-eabi
    run cargo test --features qemu --test qemu
    popd > /dev/null
}

# Links all functions of the header. The panic handler calls a function that is nowhere, so this
# fails if one of them can reach it; sections that are not reached are left out before symbols are
# looked for. That the handler itself is there, and fails, is tried as well.
capi_prove() {
    local library=$1 function functions=()
    for function in $(grep -o 'glimpse_[a-z_]*(' core/capi/include/glimpse.h include/glimpse.h \
        2> /dev/null | sed 's/.*://; s/($//' | sort -u); do
        functions+=(--undefined="$function")
    done
    say "no panic: links ${#functions[@]} functions of $library"
    ld.lld --gc-sections --entry=glimpse_version "${functions[@]}" \
        --unresolved-symbols=report-all "$library" -o "$library.proof"
    if ld.lld --gc-sections --entry=rust_begin_unwind "$library" -o "$library.proof" \
        2> /dev/null; then
        say "the proof proves nothing: the panic handler links" >&2
        exit 1
    fi
    rm -f "$library.proof"
}

# Steps of tests/run for the C library. tests/run defines `run`, `say`, `need_programs` and the variables.

# On the host: lints, the header, a call of every function, and the examples compiled by cc.
capi() {
    pushd core/capi > /dev/null
    run cargo clippy --all-targets -- -D warnings
    run cargo test
    local model
    for model in phong cook-torrance neural linear; do
        run cargo check --features "only-$model"
    done
    popd > /dev/null
}

# On microcontrollers, after `find_compiler`: the proof that no function can panic, and the examples in QEMU.
capi_firmware() {
    need_programs arm-none-eabi-gcc:gcc-arm-none-eabi ld.lld:lld
    if [ ! -e /usr/lib/arm-none-eabi/newlib ] && [ ! -e /usr/arm-none-eabi/lib ]; then
        install libnewlib-arm-none-eabi
    fi
    # In the crate's directory, which has its .cargo/config.toml.
    pushd core/capi > /dev/null
    local triple build=(build --release --target-dir "$firmware_target" "${build_std[@]}")
    run "${firmware_cargo[@]}" "${build[@]}" --target "$target" --features prove-no-panic,can-panic
    if ! { capi_links "$target" glimpse_any_of_three 2>&1 || true; } | grep glimpse_can_panic; then
        say "the proof is invalid: a function that can panic links" >&2
        exit 1
    fi
    # With a floating-point unit and without one.
    local proven=("$target" thumbv6m-none-eabi)
    run "${firmware_cargo[@]}" "${build[@]}" "${proven[@]/#/--target=}" --features prove-no-panic
    for triple in "${proven[@]}"; do
        say "no function of the header can panic on $triple"
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

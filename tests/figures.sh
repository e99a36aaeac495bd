# Figures of documents: a part of tests/run, which has `run` and `say`.

# Puts what each named command prints between its markers; with a word, only where the command has
# that word in it. trainer/docs/contributing.md says more.
figures() {
    local word="${1:-}" documents document
    run cargo build --release -p glimpse-trainer
    export OUT="${OUT:-target/figures}"
    PATH="${CARGO_TARGET_DIR:-$PWD/target}/release:$PATH"
    mapfile -t documents < <(grep -rl --include='*.md' '^<!-- printed by: ' README.md {core,trainer}/docs)
    for document in "${documents[@]}"; do
        figures_of "$document" "$word"
    done
    if [[ quickstart == *"$word"* ]]; then
        picture_of_quickstart
    fi
}

# A document is written as a whole, at its end: a command that fails leaves it as it was.
figures_of() {
    local document="$1" word="$2" begin='<!-- printed by: ' end='<!-- end of what is printed -->'
    local line command printed new='' keep=true
    while IFS= read -r line <&3; do
        if [[ "$line" == "$end" ]]; then
            keep=true
        fi
        if $keep; then
            new+="$line"$'\n'
        fi
        if [[ "$line" != "$begin"* || "$line" != *"$word"* ]]; then
            continue
        fi
        command="${line#"$begin"}"
        command="${command% -->}"
        if lacks_materials "$command"; then
            say "$document: left out, for want of TRAIN, TEST or RGL in the environment: $command"
            continue
        fi
        say "$document: $command"
        printed="$(bash -euo pipefail -c "$command")"
        keep=false
        # A table is Markdown; all else is text as a terminal shows it.
        if [[ "$printed" != '|'* ]]; then
            printed='```text'$'\n'"$printed"$'\n''```'
        fi
        new+="$printed"$'\n'
    done 3< "$document"
    printf '%s' "$new" > "$document"
}

# True if a command asks for a folder of materials that the environment does not name.
lacks_materials() {
    local name
    for name in TRAIN TEST RGL; do
        if [[ "$1" == *"\$$name"* && -z "${!name:-}" ]]; then
            return 0
        fi
    done
    return 1
}

# Makes README's picture again: the first two materials of quickstart's comparison with the paper's methods.
picture_of_quickstart() {
    local folder=target/quickstart keep
    keep='main>*{display:none}main>section:nth-of-type(2){display:block}'
    keep+='section .caption,section h3:nth-of-type(n+3),section .row:nth-of-type(n+3){display:none}'
    run trainer quickstart --out "$folder"
    sed "s|</style>|$keep</style>|" "$folder/index.html" > "$folder/picture.html"
    run chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=944,590 \
        --user-data-dir="$(mktemp -d)" --screenshot=trainer/pictures/quickstart.png \
        "file://$PWD/$folder/picture.html"
}

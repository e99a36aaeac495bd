# Figures of documents: a part of tests/run, which defines `run` and `say`.

# figures [WORD] runs the commands that documents name in markers, and replaces the text after each marker by the
# command's output. With WORD, it runs only commands that contain it. See .github/CONTRIBUTING.md.
figures() {
    local word="${1:-}" documents document
    run cargo build --release -p glimpse-trainer
    export OUT="${OUT:-target/figures}"
    PATH="${CARGO_TARGET_DIR:-$PWD/target}/release:$PATH"
    mapfile -t documents < <(grep -rl --include='*.md' '^<!-- printed by: ' README.md {core,trainer}/docs)
    for document in "${documents[@]}"; do
        update_document "$document" "$word"
    done
    if [[ quickstart == *"$word"* ]]; then
        update_readme_picture
    fi
    if [[ frontier == *"$word"* && -d "$OUT-quick/frontier" ]]; then
        local plot
        for plot in loss delta-e; do
            run cp "$OUT-quick/frontier/$plot.svg" "trainer/pictures/frontier-$plot.svg"
        done
    fi
}

# Updates one document. It is written at the end, so a failing command leaves it unchanged.
update_document() {
    local document="$1" word="$2" begin='<!-- printed by: ' end='<!-- end of what is printed -->'
    local line command output new='' keep=true
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
            say "$document: skipped, because TRAIN, TEST or RGL is not set in the environment: $command"
            continue
        fi
        say "$document: $command"
        output="$(bash -euo pipefail -c "$command")"
        keep=false
        # Tables are Markdown. Other output becomes a code block.
        if [[ "$output" != '|'* ]]; then
            output='```text'$'\n'"$output"$'\n''```'
        fi
        new+="$output"$'\n'
    done 3< "$document"
    printf '%s' "$new" > "$document"
}

# Succeeds if a command needs a folder of materials that is not set in the environment.
lacks_materials() {
    local name
    for name in TRAIN TEST RGL; do
        if [[ "$1" == *"\$$name"* && -z "${!name:-}" ]]; then
            return 0
        fi
    done
    return 1
}

# Updates the picture of the README: the first two materials in quickstart's comparison with the paper's methods.
update_readme_picture() {
    local folder=target/quickstart style
    style='main>*{display:none}main>section:nth-of-type(2){display:block}'
    style+='section .caption,section h3:nth-of-type(n+3),section .row:nth-of-type(n+3){display:none}'
    run trainer quickstart --out "$folder"
    sed "s|</style>|$style</style>|" "$folder/index.html" > "$folder/picture.html"
    run chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=944,690 \
        --user-data-dir="$(mktemp -d)" --screenshot=trainer/pictures/quickstart.png \
        "file://$PWD/$folder/picture.html"
}

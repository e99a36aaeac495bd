#!/usr/bin/env bash
# Trains all bundled recipes again, and measures their losses:
#
#   trainer/recipes/train.sh RGL/ MERL-networks/
#
# RGL/ is a folder of RGL's 17 isotropic materials, MERL-networks/ one of the 80 published networks. It takes two hours on
# two cores. A machine writes the same bytes each time; other processors give other bytes and the same losses. An
# interrupted run continues; after a change of the trainer, remove target/recipes first. Then run `tests/run targets`,
# whose budgets depend on these recipes, and `tests/figures`.
set -euo pipefail
rgl=$(realpath "$1")
merl=$(realpath "$2")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
new=target/recipes
bundled=trainer/recipes
mkdir -p "$new"/{completed,masked,timed,any,paper}
trainer() { cargo run --release --bin trainer -- "$@"; }

reach=(--max-theta-i 80 --max-theta-o 80 --min-separation 10 --noise 0.02)
prior=(--data procedural:400 --data "$rgl" --share 3,1 "${reach[@]}")
# With seed 0, the expected loss of this recipe is 0.020 instead of 0.0076.
trainer train --model neural --samples 4 "${prior[@]}" --seed 1 --resume --out "$new/neural-n4.recipe"
# Without RGL's materials, so that a test can train it again.
trainer train --model phong --samples 1 --data procedural:400 "${reach[@]}" --resume --out "$new/phong-n1.recipe"
for model in linear neural cook-torrance phong; do
    for n in 1 2 4 8 16 32; do
        trainer train --model "$model" -n "$n" "${prior[@]}" --resume --out "$new/completed/$model-n$n.recipe"
    done
    masked=(--model "$model" -n 16 "${prior[@]}" --missing 0.5 --resume)
    trainer train "${masked[@]}" --out "$new/masked/$model-n16.recipe"
    trainer train "${masked[@]}" --scan-seconds 16 --out "$new/timed/$model-n16.recipe"
    trainer train --model "$model" --samples any --data procedural:400 --data "$rgl" --share 4,1 --procedural 0 --resume \
        --out "$new/any/$model-any.recipe"
done
# Without limits or noise, with 1/10 of the paper's steps. With seed 0, Neural's expected loss is 0.075 instead of 0.052.
for model in phong cook-torrance linear; do
    trainer train --schedule paper --model "$model" --samples 8 --data procedural:80 --seed 1 --resume \
        --out "$new/paper/$model-n8.recipe"
done
trainer train --schedule paper --model neural --samples 8 --data procedural:80 --seed 3 --resume \
    --out "$new/paper/neural-n8.recipe"

for folder in completed masked timed any paper; do
    cp "$new/$folder"/*.recipe "$bundled/$folder"
done
cp "$new"/{neural-n4,phong-n1}.recipe "$bundled/completed"
cp "$new"/paper/*.recipe core/examples/recipes
cp "$new/masked/linear-n16.recipe" core/examples/recipes/linear-n16-masked.recipe
# All models for any directions have the same basis, and all other Linear recipes the same compact one.
cp "$new/any/linear-any.basis" "$bundled/any"
trainer export "$new/completed/linear-n8.recipe" --format basis --out "$bundled/linear.basis24" --force
cargo run --release -p glimpse-tests --features thorough --example recipe_losses -- "$merl" "$rgl" > "$new/losses.csv"
cp "$new/losses.csv" "$bundled"

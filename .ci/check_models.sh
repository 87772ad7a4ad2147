#!/usr/bin/env bash
# Checks the models that $MODELS lists, one pattern on a line, with the words of $ARGUMENTS as
# options and $QUERIES as file of queries. Ends with the code of the first model that is not right.
set -uo pipefail
shopt -s globstar nullglob

read -r -a options <<< "${ARGUMENTS:-}"
models=()
while IFS= read -r pattern; do
    pattern="${pattern#"${pattern%%[![:space:]]*}"}"
    pattern="${pattern%"${pattern##*[![:space:]]}"}"
    [ -n "$pattern" ] || continue
    IFS= found=($pattern)
    if [ "${#found[@]}" -eq 0 ]; then
        echo "::error title=No model::no file fits $pattern"
        exit 2
    fi
    models+=("${found[@]}")
done <<< "$MODELS"
if [ "${#models[@]}" -eq 0 ]; then
    echo "::error title=No model::the input models is empty"
    exit 2
fi

worst=0
for model in "${models[@]}"; do
    words=("$model")
    if [ -n "${QUERIES:-}" ]; then
        words+=("$QUERIES")
    elif [ -e "${model%.*}.q" ]; then
        words+=("${model%.*}.q")
    fi
    ntagen check --format github "${words[@]}" ${options[@]+"${options[@]}"}
    code=$?
    [ "$worst" -ne 0 ] || worst=$code
done
exit "$worst"

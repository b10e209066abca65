#!/usr/bin/env bash
# package.sh [OUT.vsix]: makes the extension of this folder; needs Node 20 and the npm registry, and leaves nothing here.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=$(realpath -m "${1:-rcsc.vsix}")
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
cp "$here"/{package.json,package-lock.json,.vscodeignore,README.md,extension.js,language-configuration.json,rcs.tmLanguage.json} "$made"
cp "$here/../../../LICENSE" "$made"
cd "$made"
npm ci --ignore-scripts --omit=dev --no-audit --no-fund --loglevel=error
npx --yes --loglevel=error @vscode/vsce@3.9.2 package --allow-missing-repository -o "$out"

#!/bin/sh
# Judges a renderer in CI, whoever's: verdicts, what changed against a baseline, a report. Needs `nusselt` on the PATH.
#
#   SCENES="quad my.test" RENDERER="./mine {scene} {samples} {seed} {output}" sh judge.sh
#
# BASELINE   results.json of an earlier run; none: nothing is compared
# OPTIONS    further ones of `nusselt check`, such as "--margin 0.002 --image-type .exr"
# OUT        folder for everything; `nusselt` unless said
# SUMMARY    Markdown is added to this file, which a forge shows; none: it stays in OUT
#
# Ends with the worst status of both: 1 wrong or worse, 2 bad input, 3 undecided or nothing tested, 4 no reference.
set -u
: "${SCENES:?names of scenes}" "${RENDERER:?a command with {scene\}, {samples\}, {seed\} and {output\}}"
out=${OUT:-nusselt}
mkdir -p "$out" || exit 2
for left in results.json report.html verdicts.md verdicts.xml changes.md changes.xml changes.json; do
  rm -f "$out/$left" # of an earlier run
done
status=0
# shellcheck disable=SC2086 # scenes and options are words
nusselt check $SCENES --renderer "$RENDERER" ${OPTIONS:-} --out "$out" --summary "$out/verdicts.md" --junit "$out/verdicts.xml" || status=$?
if [ -f "$out/results.json" ]; then
  nusselt report "$out" -o "$out/report.html"
  reported=$?
  [ "$status" -ne 0 ] || status=$reported
fi
if [ -n "${BASELINE:-}" ] && [ ! -f "$BASELINE" ]; then
  echo "judge.sh: no file $BASELINE: nothing is compared" >&2
elif [ -n "${BASELINE:-}" ] && [ -f "$out/results.json" ]; then
  nusselt compare "$BASELINE" "$out/results.json" --summary "$out/changes.md" --junit "$out/changes.xml" --json "$out/changes.json"
  changed=$?
  # 1 is worst, then 2, 4 and 3; 0 is best.
  for worst in 1 2 4 3; do
    if [ "$status" -eq "$worst" ] || [ "$changed" -eq "$worst" ]; then
      status=$worst
      break
    fi
  done
fi
[ -z "${SUMMARY:-}" ] || cat "$out"/verdicts.md "$out"/changes.md >>"$SUMMARY" 2>/dev/null
exit "$status"

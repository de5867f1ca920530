#!/usr/bin/env bash
# Mitsuba 3: of a version 0.5 file the property names are upgraded, the element <lookAt> is not.
#
# Guess: a file that says version="0.5.0" loads as it did in Mitsuba 0.5: its documentation says that older files are
# upgraded on the fly, and <transform name="toWorld"> is; so is <lookAt> in it, as version 0.5 wrote it.
# Seen: toWorld is taken for to_world in such a file alone (refused in later ones); <lookAt> is refused in files of
# every version, so that an unchanged 0.5 file with a camera does not load. <lookat> loads.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "mitsuba==3.9.1"
"$place/venv/bin/python" - <<'PY'
import mitsuba as mi

mi.set_variant("scalar_rgb")
print("mitsuba", mi.__version__)
SCENE = (
    '<scene version="{version}"><sensor type="perspective"><float name="fov" value="40"/>'
    '<transform name="{name}"><{tag} origin="0,2,6" target="0,0,0" up="0,1,0"/></transform></sensor></scene>'
)
expected = {
    ("0.5.0", "toWorld", "lookAt"): False,
    ("0.5.0", "to_world", "lookAt"): False,
    ("0.5.0", "toWorld", "lookat"): True,
    ("3.0.0", "toWorld", "lookat"): False,
    ("3.0.0", "to_world", "lookat"): True,
}
for (version, name, tag), loads in expected.items():
    try:
        mi.load_string(SCENE.format(version=version, name=name, tag=tag))
        seen, said = True, "loads"
    except RuntimeError as error:
        seen, said = False, str(error).replace("\n", " ")[-90:]
    print(f'version="{version}" {name:8} <{tag}>: {said}')
    if seen != loads:
        raise SystemExit(f"changed: {version}, {name}, {tag}")
PY

#!/usr/bin/env bash
# Mitsuba 3: an environment map's rows reach from pole to pole, so that a sun in it stands elsewhere than it was painted.
#
# Guess: row k of a latitude-longitude image of h rows is centred at the polar angle (k + .5) pi / h, as column i of w is at
# the azimuth (i + .5) 2 pi / w, and a row shines with its radiance over its solid angle.
# Seen: the columns are where they were expected; row k is brightest at k pi / (h - 1): the first and the last row are the
# poles themselves. With 64 rows, what is painted at 23.9 degrees from the pole is seen at 22.9; the first row has a
# third of its light at any height.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "mitsuba==3.9.1" "numpy==2.4.6"
"$place/venv/bin/python" - <<'PY'
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
print("mitsuba", mi.__version__)
H, W = 64, 128


def sky(image):
    """The radiance seen at polar angles from +y, and azimuths from -z towards +x."""
    bitmap = mi.Bitmap(np.repeat(image[:, :, None], 3, axis=2).astype(np.float32))
    emitter = mi.load_dict({"type": "scene", "sky": {"type": "envmap", "bitmap": bitmap}}).environment()
    at = mi.SurfaceInteraction3f()

    def radiance(polar, azimuth):
        across = np.sin(polar)
        at.wi = -mi.Vector3f(float(across * np.sin(azimuth)), float(np.cos(polar)), float(-across * np.cos(azimuth)))
        return emitter.eval(at)[0]

    return np.vectorize(radiance, otypes=[float])


def row_is_at(k):
    """The polar angle of row k's light, and its flux over radiance times solid angle."""
    image = np.zeros((H, W))
    image[k] = 1
    steps = 20 * H
    angle = (np.arange(steps) + 0.5) * np.pi / steps
    weight = sky(image)(angle, 1.0) * 2 * np.pi * np.sin(angle) * np.pi / steps
    solid_angle = 2 * np.pi * (np.cos(k * np.pi / H) - np.cos((k + 1) * np.pi / H))
    return np.degrees((weight * angle).sum() / weight.sum()), weight.sum() / solid_angle


def column_is_at(i):
    image = np.zeros((H, W))
    image[:, i] = 1
    angle = (np.arange(20 * W) + 0.5) * 2 * np.pi / (20 * W)
    weight = sky(image)(np.pi / 2, angle)
    return np.degrees((weight * angle).sum() / weight.sum())


shift = {}
for k in (0, 8, 16, 24):
    seen, share = row_is_at(k)
    shift[k] = seen - np.degrees((k + 0.5) * np.pi / H)
    print(f"row {k:2}: painted at {seen - shift[k]:6.3f}, seen at {seen:6.3f} degrees, {share:.3f} of its light")
    if k and abs(seen - np.degrees(k * np.pi / (H - 1))) > 0.1:
        raise SystemExit("changed: the rows")
    if k == 0 and not 0.3 < share < 0.4:
        raise SystemExit("changed: the light of the first row")
if shift[8] > -0.9 or shift[16] > -0.6:
    raise SystemExit("changed: the rows")
for i in (32, 96):
    print(f"column {i}: painted at {(i + 0.5) * 360 / W:7.3f}, seen at {column_is_at(i):7.3f} degrees")
    if abs(column_is_at(i) - (i + 0.5) * 360 / W) > 0.05:
        raise SystemExit("changed: the columns")
PY

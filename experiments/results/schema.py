"""The interface: every entry of `results.json`, its kind, its unit and what it means.

A file is an object of the entries `HEAD`; its ``rows`` are objects of the entries `ROW`. Any entry may be missing: it
was not asked for there. Any may be null: it was not measured, or is no finite number. A name means the same in every
row, whoever wrote it. Entries of other names may stand beside these, and are nobody's promise.

"Relative" is to the reference's mean radiance over shaded pixels, averaged over channels. A pass is one whole image
with random numbers of its own. Samples are per pixel and light. An interval is ``[low, high]``.

The entries of single experiments stand in `study_entries`. `check` looks at every file that is written or read.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias

from nusselt.renderer.errors import InputError

from .kinds import COUNT, FLAG, GRID, INTERVAL, NUMBER, OBJECT, OBJECTS, TEXT, TEXTS, TIMES, Entry, one_of
from .study_entries import OF_EXPERIMENTS

Row: TypeAlias = dict[str, Any]

SCHEMA = 2
"""2: experiments call relative errors ``rms_relative`` and ``bias_relative``, as everybody does (``rms``, ``bias``)."""
READABLE = (1, 2)
PICTURES = ("tiles", "tile_p")
"""Pictures rather than figures: no table shows them."""

HEAD = (
    Entry("schema", COUNT, "version of this interface"),
    Entry("machine", OBJECT, "what the figures were measured on: system, processor, cores, python"),
    Entry("versions", OBJECT, "packages that can change a figure; null where one is missing"),
    Entry("alpha", NUMBER, "chance that a right renderer fails this report"),
    Entry("seed", COUNT, "root of every experiment's seeds"),
    Entry("quick", FLAG, "whether experiments were run small"),
    Entry("seconds", OBJECT, "written: when, in UTC"),
    Entry("rows", OBJECTS, "what was found"),
    Entry("estimator", TEXT, "test-estimator: the class that was tried"),
    Entry("trials", OBJECTS, "test-estimator: trial, passed, found"),
    Entry("error_against_time", OBJECTS, "test-estimator: samples, rms, rms_relative, seconds"),
)

ASKED = (
    Entry("experiment", TEXT, "which experiment's row it is; without it, that of `nusselt check`"),
    Entry("scene", TEXT, "name of the scene, or of what stands in its place"),
    Entry("estimator", TEXT, "what made the image"),
    Entry("method", TEXT, "the same where the estimator's name does not say it"),
    Entry("renderer", TEXT, "whose image: ours, or mitsuba"),
    Entry("claim", one_of("exact", "unbiased", "consistent", "biased"), "what the estimator says of itself there"),
    Entry("samples", COUNT, "of ours in one pass; 0 where there are none"),
    Entry("stratified", FLAG, "whether they are jittered in strata"),
    Entry("passes", COUNT, "of ours"),
    Entry("margin", NUMBER, "bias declared not to matter", "relative"),
    Entry("seed", COUNT, "root of all random numbers"),
    Entry("command", TEXT, "makes the row again"),
    Entry("test", TEXT, "of pytest: which asked"),
    Entry("looks", COUNT, "check --until-decided: how often it was judged"),
)
"""What was asked."""

JUDGED = (
    Entry("pixels", OBJECT, "how many are shaded and judged, emitter, background, unjudged"),
    Entry("bias", NUMBER, "mean of ours - reference over shaded pixels", "radiance"),
    Entry("bias_relative", NUMBER, "the same", "relative"),
    Entry("bias_interval", INTERVAL, "the bias lies in it, at the report's false-alarm rate", "relative"),
    Entry("minimum_detectable_bias", NUMBER, "smallest bias found with 99 % power", "relative"),
    Entry("rms", NUMBER, "root mean square of one pass - reference, pixel by pixel", "radiance"),
    Entry("rms_relative", NUMBER, "the same", "relative"),
    Entry("rms_denoised_relative", NUMBER, "of the mean of all passes, the noise of both sides taken out", "relative"),
    Entry("rms_denoised_interval", INTERVAL, "its interval", "relative"),
    Entry("variance", NUMBER, "of a pixel in one pass, mean over the judged pixels", "radiance squared"),
    Entry("variance_ratio", NUMBER, "the variance over Mitsuba's for the same strategy and samples"),
    Entry("variance_ratio_interval", INTERVAL, "its interval"),
    Entry("pass_spread", NUMBER, "variance of the passes' means over what independent pixels would have"),
    Entry("noise_word", TEXT, "noise: as expected, noisier, quieter, or alike (in pixels that share it)"),
    Entry("noise_alike", NUMBER, "largest correlation of the noise with itself some pixels away, where beyond chance"),
    Entry("pixels_off", COUNT, "pixels that are off beyond any noise"),
    Entry("finds", OBJECT, "smallest contrast, residual (rms) and single pixel that would have been found", "relative"),
    Entry("excess_kurtosis", OBJECT, "of both sides' pass means, pooled over pixels"),
    Entry("non_finite", COUNT, "pixels of ours that are not finite"),
    Entry("reason", TEXT, "why the verdict, in a sentence"),
    Entry("tiles", GRID, "bias of each of 8 x 8 tiles", "relative"),
    Entry("tile_p", GRID, "its p-value; null where nothing is judged or there is no noise"),
    Entry("tiles_without_noise", COUNT, "tiles that are judged by their margin alone"),
)
"""What the judge says: the fields of its `Verdict`, by their names."""

COURSE = (
    Entry("course_bias", NUMBER, "the course's score: mean difference of one image", "8-bit levels"),
    Entry("course_mse", NUMBER, "the course's score: mean squared difference of one image", "8-bit levels squared"),
    Entry(
        "course_expected",
        OBJECT,
        "what a right image gets",
        parts=(Entry("bias", INTERVAL, "", "8-bit levels"), Entry("mse", INTERVAL, "", "8-bit levels squared")),
    ),
)
"""The course's own scores."""

REFERENCE = (
    Entry("renderer", TEXT, "what made it; null where it could not run"),
    Entry("version", TEXT, "of that renderer"),
    Entry("variant", TEXT, "of Mitsuba"),
    Entry("llvm", TEXT, "version of the LLVM it ran with"),
    Entry("samples", COUNT, "in all its passes"),
    Entry("passes", COUNT, "independent ones"),
    Entry("standard_error_relative", NUMBER, "of its mean over shaded pixels", "relative"),
    Entry("notes", TEXTS, "what is approximate about it"),
    Entry("limits", TEXTS, "why it may be wrong itself, so that a finding that this explains is not to be trusted"),
)

CHECKED = (
    Entry("verdict", one_of("agrees", "differs", "undecided"), "on the bias and everything else that is tested"),
    Entry("as_claimed", FLAG, "whether the row is what its method claims; null: undecided; missing: none is made"),
    Entry("bias_relative_standard_error", NUMBER, "of the bias", "relative"),
    Entry("bias_relative_freedom", NUMBER, "its degrees of freedom"),
    Entry("variance_standard_error", NUMBER, "of the variance", "radiance squared"),
    Entry("mse_relative", NUMBER, "mean square error of one pass, the reference's noise taken out", "relative squared"),
    Entry("mse_relative_standard_error", NUMBER, "its standard error", "relative squared"),
    Entry(
        "samples_to_decide",
        OBJECT,
        "how many would decide, if the bias is what it seems",
        parts=(Entry("ours", COUNT, ""), Entry("reference", COUNT, "")),
    ),
    Entry("reference", OBJECT, "what ours was compared with", parts=REFERENCE),
    Entry(
        "left_out",
        OBJECTS,
        "work that the scene does not need",
        parts=(Entry("what", TEXT, ""), Entry("why", TEXT, "")),
    ),
    Entry("routes", OBJECT, "of an estimator that chooses by the point: pixels times lights that took each route"),
    Entry("bound", NUMBER, "the largest bound of any value's error, in units of what its light gives unoccluded"),
    Entry("warnings", TEXTS, "what to know of the scene or the images"),
    Entry("images", OBJECT, "files beside results.json, by what they show"),
    Entry("seconds", TIMES, "wall time of one image, of each of several, by stage, or as median", "s"),
)

BROUGHT = (
    Entry("compared_estimator", TEXT, "ours, whose noise and hypotheses stand beside the images"),
    Entry("brought", TEXTS, "where the images came from"),
    Entry("course_scores", OBJECTS, "bias and mse of every image", "8-bit levels, and squared"),
    Entry("quantisation", OBJECT, "how levels were made: levels, transfer, rule, given"),
    Entry("saturated", OBJECT, "shaded pixels: masked, at_the_top"),
    Entry("single_image", FLAG, "whether its noise could not be measured"),
    Entry(
        "likely_mistakes",
        OBJECTS,
        "what the difference looks like; several where they cannot be told apart",
        parts=(
            Entry("name", TEXT, "the hypothesis"),
            Entry("explained", NUMBER, "share of the difference beyond noise"),
            Entry("detail", TEXT, "which of its kind"),
            Entry("sure", NUMBER, "standard errors by which it fits better than no mistake"),
            Entry("rest", FLAG, "whether more than noise is left"),
            Entry("hint", TEXT, "what to look for in one's code"),
            Entry("named_wrongly", NUMBER, "share of right images that are given a name, at most, were they diagnosed"),
        ),
    ),
    Entry("where", TEXTS, "the smallest places that hold the difference"),
    Entry("convergence", OBJECT, "a program's error: rows, slope_samples, slope_seconds"),
    Entry("renderer_command", TEXT, "the program that was run"),
)
"""Of images and programs that somebody brought."""

ROW = (*ASKED, *JUDGED, *COURSE, *CHECKED, *BROUGHT, *OF_EXPERIMENTS)


def names(entries: Iterable[Entry]) -> tuple[str, ...]:
    """Their names, in order."""
    return tuple(entry.name for entry in entries)


def check_entries(found: dict[str, Any], entries: Iterable[Entry], where: str, prefix: str = "") -> None:
    """Refuse an object of JSON types with an entry that is not what the schema says.

    Raises
    ------
    InputError
        Naming the place, the entry, its value and what is accepted.
    """
    for entry in entries:
        value, name = found.get(entry.name), prefix + entry.name
        if value is None:
            continue
        if not entry.kind.accepts(value):
            raise InputError(name, value, entry.kind.words, where)
        for part in value if isinstance(value, list) and entry.parts else [value] if entry.parts else ():
            check_entries(part or {}, entry.parts, where, f"{name}.")


def check(document: Any, where: str = "") -> None:
    """Refuse what is no results file of this schema.

    Parameters
    ----------
    document : object
        JSON types.
    where : str
        The file, for the error.

    Raises
    ------
    InputError
        Naming file, row, entry, value and what is accepted.
    """
    if not isinstance(document, dict) or document.get("schema") not in READABLE:
        found = document.get("schema") if isinstance(document, dict) else document
        raise InputError("schema", found, f"a results.json of schema {' or '.join(map(str, READABLE))}", where)
    if not isinstance(document.get("rows"), list):
        raise InputError("rows", document.get("rows"), "a list of objects", where)
    check_entries(document, HEAD, where)
    for number, row in enumerate(document["rows"], start=1):
        check_row(row, f"{where}: row {number}" if where else f"row {number}")


def check_row(row: Any, where: str) -> None:
    """Refuse a row of JSON types that is not one."""
    if not isinstance(row, dict):
        raise InputError("row", row, "an object", where)
    check_entries(row, ROW, where)

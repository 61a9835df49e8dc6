"""The flow chart: image, threshold, markers, ring, ellipse, poses, choice."""

import os
import time
from pathlib import Path

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.image import (
    ImageError,
    as_picture,
    darkest_channel,
    decode,
    orientation_of,
    orientation_sentence,
    read_picture_file,
    significant_bits,
    to_grey,
    without_defects,
)
from dockpose.checks import check_is
from dockpose.dock import Dock
from dockpose.estimate.by_hand import at_lights
from dockpose.estimate.drawing import picture_of
from dockpose.estimate.result import Estimate
from dockpose.estimate.search import search
from dockpose.estimate.stages import Picture
from dockpose.lights.by_hand import ByHand
from dockpose.lights.masks import hide
from dockpose.lights.region import Region, crop, masks_within, part_of
from dockpose.settings import Settings
from dockpose.sidecar import completed, lights_beside, sample_source
from dockpose.text import shown
from dockpose.thresholds import MethodError, histogram_of
from numpy.typing import ArrayLike


def estimate(
    image: np.ndarray | str | os.PathLike[str],
    camera: Camera | None = None,
    dock: Dock | None = None,
    settings: Settings | None = None,
    *,
    fall_back: bool = True,
    previous: Estimate | None = None,
    lights_px: ArrayLike | None = None,
    snap: ArrayLike = False,
) -> Estimate:
    """Find the dock in one picture, or take the lights that somebody has set in it.

    Parameters
    ----------
    image : array or path
        (H, W) grey, (H, W, 3) BGR or (H, W, 4) BGRA array of uint8 or uint16, or of floats from 0 to 1, which become 16
        bits; pixels that are masked, as of ``numpy.ma``, are not looked at. Or the path of a picture file, of which no
        tag of orientation is applied; the message names it. Or the name of a sample scene, such as ``"tilted"``.
    camera : Camera, optional
        Its intrinsics; a picture that is the calibration's rescaled is taken, another size is refused. Of a file, what
        NAME.yaml beside NAME.png says where none is given.
    dock : Dock, optional
        Its diameter, and its number of lights where known. Of a file, as the camera.
    settings : Settings, optional
        How to search; the defaults suit most scenes.
    fall_back : bool
        Let hats give each light a level of its own where no single level shows the ring. A comparison of the
        methods wants each as it is.
    previous : Estimate or None
        An estimate of this very picture, as with another camera or dock. Where settings and tone curve are the same
        and it was searched, its threshold and its groups are taken over, which saves most of the time.
    lights_px : (N, 2) array_like, optional
        Where the dock's lights are in the picture, x and y of each in pixels, as a person sees them: nothing is
        searched then, and ``detection`` is None. Five or more, or three or more of a dock whose number is known. Of a
        file, what NAME.yaml beside it says where none are given.
    snap : bool or (N,) array_like of bool
        Take the centre of the bright spot at each of these. Where there is none, and without ``snap``, a light is
        where it was set, to 0.7 pixels.

    Returns
    -------
    Estimate
        Whatever the picture shows: one without a dock has a status other than "ok" and says why.

    Raises
    ------
    ValueError
        if the file cannot be read, an argument is of another kind, the image is no such picture or does not belong to
        the camera.
    """
    if isinstance(image, (str, os.PathLike)):
        image = Path(sample_source(str(image)))
        if camera is None or dock is None:
            camera, dock = completed(image, camera, dock)
        if lights_px is None and (beside := lights_beside(image)) is not None:
            lights_px, snap = beside.lights_px, beside.snap
    camera, dock = check_is("camera", camera, Camera), check_is("dock", dock, Dock)
    settings = check_is("settings", settings or Settings(), Settings)
    given, path, note = image, None, ""
    if isinstance(image, Path):
        path = image
        data = read_picture_file(path)
        image, note = decode(data, str(path)), orientation_sentence(orientation_of(data), str(path))
    elif not hasattr(image, "__array__"):
        raise ImageError(f"image is {shown(image)}; it must be an array of pixels, or the path of a picture file")
    start = time.perf_counter()
    whole: np.ndarray = np.asarray(image)
    is_masked = type(image) is not np.ndarray and np.ma.is_masked(image)
    hidden: np.ndarray | None = np.asarray(np.ma.getmaskarray(image)) if is_masked else None
    picture = picture_in(whole, camera, settings, hidden=hidden, previous=previous)
    height, width = whole.shape[:2]
    scaled = camera.for_size(width, height)
    counted = picture.histogram.counted
    try:
        if lights_px is not None:
            lights = ByHand.checked(lights_px, snap, width, height)
            status, message, stages = at_lights(picture, scaled, dock, settings, lights)
        elif counted is not None and not counted.any():
            status, message, stages = "no_lights", "No lights: the whole picture is masked.", {}
        else:
            status, message, stages = search(picture, scaled, dock, settings, fall_back)
    except MethodError as error:
        status, message, stages = "method_failed", f"{str(error)[:1].upper()}{str(error)[1:]}.", {}
    message += notes_on(camera, scaled)
    if note:
        message += f" {note[:1].upper()}{note[1:]}."
    elapsed_ms = 1000 * (time.perf_counter() - start)
    bits = significant_bits(picture.grey)
    return Estimate(
        status,
        message,
        width,
        height,
        bits,
        scaled,
        dock,
        settings,
        **stages,
        elapsed_ms=elapsed_ms,
        picture=picture_of(given, path),
    )


def picture_in(
    whole: np.ndarray,
    camera: Camera,
    settings: Settings,
    region: Region | None = None,
    min_channel: bool = False,
    *,
    hidden: np.ndarray | None = None,
    previous: Estimate | None = None,
) -> Picture:
    """Return what is looked at of a picture: a region of it or all, in grey or in the darkest of its colours."""
    image, part = whole, None
    if whole.ndim >= 2 and region is not None:
        part = part_of(region, whole.shape[1], whole.shape[0])
        image, hidden = crop(whole, part), None if hidden is None else crop(hidden, part)
    # Compiled code is for arrays without gaps that may be written to, and would be compiled anew for others.
    image = as_picture(image)
    grey = darkest_channel(image) if min_channel else None
    grey = np.require(to_grey(image) if grey is None else grey, requirements=["C", "W"])
    part = part or part_of(None, *grey.shape[::-1])
    height, width = whole.shape[:2]
    if hidden is not None:
        hidden = np.atleast_2d(hidden.reshape(*grey.shape, -1).any(axis=2))
    grey, counted = hide(grey, masks_within(settings.masks, part), hidden)
    if previous is not None and (previous.settings, previous.camera.tone, previous.found_by) != (
        settings,
        camera.tone,
        "search",
    ):
        previous = None
    grey = without_defects(grey)
    return Picture(image, grey, histogram_of(grey, counted), part, width, height, previous, camera.tone)


def notes_on(camera: Camera, scaled: Camera) -> str:
    """Return a sentence on how a camera was scaled to the picture, after a space; empty where it was not."""
    if scaled is camera or (scaled.width, scaled.height) == (camera.width, camera.height):
        return ""
    size = f"{scaled.width} x {scaled.height}"
    return f" The camera's intrinsics were scaled from {camera.width} x {camera.height} to {size}."

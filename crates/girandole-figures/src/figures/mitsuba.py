"""Renders scene.xml of a folder by Mitsuba 3's path integrator: mitsuba.py VARIANT FOLDER SAMPLES...

Writes SAMPLES.exr, and prints the samples a pixel and the seconds of each,
after the word "rendered": Mitsuba prints more.
"""
import sys
import time

import mitsuba as mi

variant, folder, *counts = sys.argv[1:]
mi.set_variant(variant)
scene = mi.load_file(folder + "/scene.xml")


def render(count):
    start = time.perf_counter()
    bitmap = mi.Bitmap(mi.render(scene, spp=count, seed=0))
    return bitmap, time.perf_counter() - start


render(int(counts[0]))  # Kernels are compiled.
for count in map(int, counts):
    bitmap, seconds = render(count)
    rgb = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    rgb.write(f"{folder}/{count}.exr")
    print("rendered", count, seconds, flush=True)

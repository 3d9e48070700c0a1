#!/usr/bin/env python3
"""Exports a Blender scene for render-cli:

    blender -b lamp.blend -P apps/blender/export.py -- lamp.xml
    python apps/blender/export.py lamp.blend lamp.xml       (with Blender's module for Python: pip install bpy)

What doesn't map is said on standard error, a line each, and in a comment at the top of the file. Exit code 0: exported;
2: wrong usage; 3: the scene can't be exported, or with --strict, something doesn't map; 6: a file could not be written.
"""

import argparse
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))


def _arguments():
    """Blender keeps for itself what comes before "--"; on its own this script gets the scene's file, too."""
    inside = os.path.basename(sys.argv[0]).startswith("blender") or "--" in sys.argv
    given = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else ([] if inside else sys.argv[1:])
    parser = argparse.ArgumentParser(prog="export.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    if not inside:
        parser.add_argument("blend", help="Blender's file")
    parser.add_argument("xml", help="the file to write; meshes and pictures go to a folder beside it")
    parser.add_argument("--scene", help="the scene's name (the one that was open when the file was saved)")
    parser.add_argument("--frame", type=int, help="the frame (the current one)")
    parser.add_argument("--spot-falloff", choices=["exact", "linear"], default="exact",
                        help="exact: Blender's, by a gobo; linear in the angle, of the same flux: renders faster")
    parser.add_argument("--strict", action="store_true", help="fail if something doesn't map")
    return parser.parse_args(given)


def main():
    options = _arguments()
    try:
        import bpy
    except ImportError as error:
        print("export.py: %s: pip install bpy and what it needs, or have Blender run this, by -P" % error,
              file=sys.stderr)
        return 1
    import brume_export
    if getattr(options, "blend", None):
        try:
            bpy.ops.wm.open_mainfile(filepath=options.blend)
        except RuntimeError as error:
            print("export.py: %s" % str(error).strip(), file=sys.stderr)
            return 3
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_brume"):
        brume_export.register()
    scene = bpy.context.scene
    if options.scene:
        scene = bpy.data.scenes.get(options.scene)
        if scene is None:
            print("export.py: there is no scene %s" % options.scene, file=sys.stderr)
            return 2
    if options.frame is not None:
        scene.frame_set(options.frame)
    try:
        report = brume_export.export_scene(options.xml, options.spot_falloff, scene=scene)
    except brume_export.ExportError as error:
        print("export.py: %s" % error, file=sys.stderr)
        return 3
    except OSError as error:
        print("export.py: %s" % error, file=sys.stderr)
        return 6
    return 3 if options.strict and report.warnings else 0


if __name__ == "__main__":
    try:
        code = main()
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 2
    except Exception:
        import traceback
        traceback.print_exc()
        code = 1
    # Blender's module for Python can wait for its threads forever as it is taken down, and Blender itself takes no
    # exit code from a script but this way.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)

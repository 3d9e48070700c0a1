"""One scene file from what Blender would render: a depsgraph in render mode."""

import os

from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree

from . import camera, elements, images, lights, materials, meshes, volumes, world
from .report import ExportError

# Objects that are there to work with, and never rendered.
NEVER_RENDERED = {"EMPTY", "ARMATURE", "LATTICE", "CAMERA", "SPEAKER", "LIGHT_PROBE", "LIGHT"}
MESH_LIKE = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
# How far the two sides of an emitting sheet are apart, over its size.
SHEET = 1e-5


class Fog:
    """An instance with a volume in it."""

    def __init__(self, name, medium, vertices, triangles):
        self.name, self.medium = name, medium
        self.vertices = vertices
        self.tree = BVHTree.FromPolygons(vertices, triangles)
        self.around, self.shapes = [], []

    def holds(self, point):
        """Whether a point lies inside: rays of three odd directions, by majority."""
        votes = 0
        for direction in (Vector((0.613, 0.548, 0.569)), Vector((-0.283, 0.851, -0.442)), Vector((0.12, -0.47, 0.874))):
            crossings, origin = 0, Vector(point)
            while crossings < 1000:
                hit, _, _, distance = self.tree.ray_cast(origin, direction)
                if hit is None:
                    break
                crossings += 1
                origin = hit + direction * max(1e-5, 1e-5 * distance)
            votes += crossings % 2
        return votes >= 2


class Exporter:
    def __init__(self, depsgraph, path, report, spot_falloff="exact"):
        self._depsgraph, self._path, self._report = depsgraph, path, report
        self._scene = depsgraph.scene
        self._folder = images.Folder(path)
        self._exposure = self._scene.cycles.film_exposure
        self._materials = materials.Materials(report, self._folder)
        self._lights = lights.Lights(report, self._folder, self._exposure, spot_falloff)
        self._surfaces, self._volumes, self._files = {}, {}, {}
        self._media, self._bsdfs, self._shapes, self._lamps, self._fogs = {}, [], [], [], []
        self._hidden_lamps, self._seen_emitters, self._balls = [], [], []
        self._low, self._high = Vector((1e30,) * 3), Vector((-1e30,) * 3)
        self._world_volume = world.volume(report, self._scene.world)

    # ---- media --------------------------------------------------------------------------------------------------

    def _medium_id(self, medium):
        """The id of a medium; None for vacuum."""
        if not medium:
            return None
        key = (tuple(medium.sigma_s), tuple(medium.sigma_a), tuple(medium.emission), medium.g)
        if key not in self._media:
            identifier = "medium-%d" % (len(self._media) + 1)
            self._media[key] = medium.element(identifier, self._exposure)
        return self._media[key].get("id")

    def _sum(self, fogs):
        """Volumes in one place add up, as in Cycles."""
        total = self._world_volume
        for fog in fogs:
            total = total.plus(fog.medium, self._report, "volume of " + fog.name)
        return total

    def _nest(self):
        """Which volumes each one lies in."""
        for fog in self._fogs:
            step = max(1, len(fog.vertices) // 32)
            probes = fog.vertices[::step]
            for other in self._fogs:
                if other is fog:
                    continue
                inside = sum(other.holds(point) for point in probes)
                if inside == len(probes):
                    fog.around.append(other)
                elif inside:
                    self._report.warn("volumes of %s and %s" % (fog.name, other.name), "they overlap in part",
                                      "where they do, it is as if only the one entered last were there")

    # ---- surfaces -----------------------------------------------------------------------------------------------

    def _surface_of(self, material):
        """(Surface, id of its BSDF or None, Medium within) of a material."""
        key = material.name_full if material else None
        if key not in self._surfaces:
            surface = self._materials.read(material)
            identifier = "material-" + images.safe_name(key) if key else "default"
            if any(element.get("id") == identifier for element in self._bsdfs):
                identifier += "-%d" % len(self._bsdfs)
            element = self._materials.element(surface, identifier)
            if element is not None:
                self._bsdfs.append(element)
            tree = material.node_tree if material and material.use_nodes else None
            place = materials.nodes.output(tree, "Volume")
            within = volumes.read(self._report, "material " + material.name, place) if place else volumes.Medium()
            self._surfaces[key] = surface, identifier if element is not None else None, within
        return self._surfaces[key]

    def _mesh_files(self, source, name, mirrored, backs):
        """[(slot, path, face_normals)], whether the mesh is closed, its vertices and triangles in its own space."""
        data = source.data
        key = (data.as_pointer() if source.type == "MESH" and data else source.as_pointer(), mirrored, backs)
        if key in self._files:
            return self._files[key]
        mesh = source.to_mesh()
        try:
            if mesh is None or not len(mesh.polygons):
                self._files[key] = None
                return None
            arrays = meshes.Arrays(mesh)
        finally:
            source.to_mesh_clear()
        closed = arrays.is_closed()
        if mirrored:
            arrays.mirrored()
        if backs:
            size = float((arrays.vertices.max(0) - arrays.vertices.min(0)).max())
            arrays.backs(SHEET * size)
        parts = []
        for slot in sorted(set(arrays.slots.tolist())):
            relative = self._folder.new(name + ("-back" if backs else "") + ("-mirrored" if mirrored else ""), ".ply")
            parts.append((slot, relative, meshes.write(arrays, slot, self._folder.path(relative))))
        self._files[key] = parts, closed, arrays.vertices, arrays.indices
        return self._files[key]

    def _shape(self, part, matrix, surface, bsdf, emission):
        shape = elements.plugin("shape", "ply")
        elements.add(shape, "string", "filename", part[1])
        if part[2]:
            elements.add(shape, "boolean", "face_normals", True)
        elements.add_matrix(shape, matrix)
        if bsdf:
            elements.add_ref(shape, bsdf)
        if any(emission):
            emitter = elements.plugin("emitter", "area")
            elements.add(emitter, "rgb", "radiance", [max(0.0, self._exposure * x) for x in emission])
            shape.append(emitter)
        self._shapes.append(shape)
        return shape

    def _mesh(self, instance):
        source, matrix, name = instance.object, instance.matrix_world.copy(), instance.object.name
        mirrored = matrix.determinant() < 0
        if abs(matrix.determinant()) < 1e-30:
            self._report.warn("object " + name, "its transform is singular", "it is left out")
            return
        found = self._mesh_files(source, name, mirrored, False)
        if found is None:
            return
        parts, closed, vertices, triangles = found
        if mirrored:
            matrix = matrix @ Matrix.Diagonal((-1, 1, 1, 1))
        hidden = [ray for ray in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")
                  if not getattr(source.original, "visible_" + ray)]
        if hidden:
            self._report.warn("object " + name, "it is hidden from %s rays" % ", ".join(hidden),
                              "exported as seen by them")
        if source.original.is_shadow_catcher or source.original.is_holdout:
            self._report.warn("object " + name, "shadow catchers and holdouts aren't there", "exported as an object")
        placed = [matrix @ Vector(v) for v in vertices.tolist()]
        for i in range(3):
            self._low[i] = min(self._low[i], min(v[i] for v in placed))
            self._high[i] = max(self._high[i], max(v[i] for v in placed))
        fog = None
        for part in parts:
            slots = source.material_slots
            material = slots[min(part[0], len(slots) - 1)].material if len(slots) else None
            surface, bsdf, within = self._surface_of(material)
            shape = self._shape(part, matrix, surface, bsdf, surface.emission)
            if any(surface.emission):
                self._seen_emitters.append(name)
                if not closed:
                    self._back(source, name, mirrored, part[0], matrix, surface, bsdf)
            if within and surface.bsdf in ("null", "dielectric"):
                fog = self._fog(fog, name, within, placed, triangles, closed)
                fog.shapes.append(shape)

    def _back(self, source, name, mirrored, slot, matrix, surface, bsdf):
        """A sheet shines to both sides in Cycles; a surface of ours to one."""
        for part in self._mesh_files(source, name, mirrored, True)[0]:
            if part[0] == slot:
                self._shape(part, matrix, surface, bsdf, surface.emission)

    def _fog(self, fog, name, medium, placed, triangles, closed):
        if fog is None:
            if not closed:
                self._report.warn("object " + name, "its mesh isn't closed, so that its volume has no inside",
                                  "the volume reaches out through the gaps")
            fog = Fog(name, medium, placed, triangles.tolist())
            self._fogs.append(fog)
        elif fog.medium is not medium:
            self._report.warn("object " + name, "it has more than one volume material", "each face leads into its own")
        return fog

    # ---- the scene ----------------------------------------------------------------------------------------------

    def _instances(self):
        for instance in self._depsgraph.object_instances:
            source = instance.object
            if not instance.show_self:
                continue
            if source.type == "LIGHT":
                self._lamp(instance)
            elif source.type in MESH_LIKE:
                self._mesh(instance)
            elif source.type not in NEVER_RENDERED:
                self._report.warn("object " + source.name, "a %s isn't exported" % source.type.lower(),
                                  "it is left out")
            if any(p.settings.type == "HAIR" and p.settings.render_type == "PATH" for p in source.particle_systems):
                self._report.warn("object " + source.name, "its hair isn't exported", "it is left out")

    def _lamp(self, instance):
        source, matrix = instance.object, instance.matrix_world.copy()
        made = self._lights.export(source, matrix)
        self._lamps += made
        if source.data.type == "POINT" and source.data.shadow_soft_size > 0:
            self._balls.append((source.name, matrix.translation.copy(), source.data))
        if source.data.type == "SUN" and self._world_volume:
            self._report.warn("light " + source.name, "the world's volume lies between it and everything",
                              "it lights nothing, as in Cycles")
        if any(element.tag == "shape" for element in made):
            if source.original.visible_camera:
                self._seen_emitters.append(source.name)
            elif self._in_view(matrix, source.data):
                self._hidden_lamps.append(source.name)

    def _in_view(self, matrix, lamp):
        """Whether the camera might see a lamp: a ball about it against the camera's half-space and its frame."""
        if lamp.type == "AREA":
            radius = 0.71 * max(lamp.size, lamp.size_y) * max(matrix.to_scale())
        else:
            radius = lamp.shadow_soft_size
        view = camera.rigid(self._scene.camera.evaluated_get(self._depsgraph).matrix_world).inverted()
        p = view @ matrix.translation
        data = self._scene.camera.data
        if data.type != "PERSP":
            return True
        corners = data.view_frame(scene=self._scene)
        depth = -corners[0].z
        if -p.z < -radius:
            return False
        for axis in range(2):
            for sign in (-1, 1):
                edge = max(sign * c[axis] for c in corners) / depth
                if (sign * p[axis] + edge * p.z) / (1 + edge * edge) ** 0.5 > radius:
                    return False
        return True

    def _hide(self, backdrop):
        """hide_emitters hides all that shines from the camera; Blender tells lamp by lamp."""
        transparent = self._scene.render.film_transparent
        seen = self._seen_emitters + (["the world"] if backdrop is not None and not transparent else [])
        wanted = self._hidden_lamps + (["the world"] if transparent and backdrop is not None else [])
        if wanted and seen:
            self._report.warn("camera " + self._scene.camera.name, "%s should be hidden from it and %s not" %
                              (", ".join(wanted), ", ".join(seen)), "all are seen")
        return bool(wanted) and not seen

    def _finish_fogs(self):
        self._nest()
        for fog in self._fogs:
            outside, inside = self._sum(fog.around), self._sum(fog.around + [fog])
            for shape in fog.shapes:
                for name, medium in (("interior", inside), ("exterior", outside)):
                    if medium:
                        elements.add_ref(shape, self._medium_id(medium), name)

    def _check_balls(self):
        """Next to a lamp with extent Cycles lights fog by rules of its own. To all directions together a point shines
        4 pi I on each shell about it. Less near a ball: as if 0.67 radii of shells were missing (it is dark within);
        near Cycles' soft falloff, as if 4/3 were; and without it, as if there were 0.67 more (it is bright within)."""
        for name, place, lamp in self._balls:
            around = self._sum([fog for fog in self._fogs if fog.holds(place)])
            if any(around.sigma_s):
                shells = 2 / 3 if lamp.use_soft_falloff else -4 / 3
                self._report.warn(
                    "light " + name, "it stands in fog, which Cycles lights otherwise next to a lamp with a radius",
                    "exported as a ball: fog about it scatters %s, as if by a shell %.3g thick (radius 0 is exact)" %
                    ("more" if shells > 0 else "less", abs(shells) * lamp.shadow_soft_size))

    def run(self):
        """Writes the scene file, and beside it a folder with its meshes and pictures."""
        scene = self._scene
        if scene.camera is None or scene.camera.type != "CAMERA":
            raise ExportError("the scene has no camera")
        os.makedirs(self._folder.base, exist_ok=True)
        self._instances()
        backdrop = world.background(self._report, self._folder, scene.world, self._exposure)
        if backdrop is not None and self._world_volume:
            self._report.warn("world " + scene.world.name, "its volume lies before its background",
                              "the background is seen nowhere, as in Cycles")
            backdrop = None
        self._finish_fogs()
        self._check_balls()
        eye = scene.camera.evaluated_get(self._depsgraph).matrix_world.translation
        standing = self._sum([fog for fog in self._fogs if fog.holds(eye)])
        radius = max([abs(x - e) for corner in (self._low, self._high) for x, e in zip(corner, eye)]) \
            if self._shapes else 1.0
        sensor = camera.sensor(self._report, scene, self._depsgraph, radius, self._medium_id(standing))
        scatters = self._world_volume or self._fogs
        if scene.view_settings.view_transform not in ("Standard", "Raw"):
            self._report.note("The view transform %s is Blender's: pictures here are plain sRGB or linear."
                              % scene.view_settings.view_transform)
        root = elements.plugin("scene", "")
        root.attrib = {"version": "3.0.0"}
        root.append(camera.integrator(self._report, scene, scatters, self._hide(backdrop)))
        for element in [*self._media.values(), sensor, *self._bsdfs, *self._lamps,
                        *([backdrop] if backdrop is not None else []), *self._shapes]:
            root.append(element)
        lines = ["Exported from Blender: scene %s." % scene.name]
        lines += ["warning: " + line for line in self._report.warnings]
        lines += ["note: " + line for line in self._report.notes]
        root.insert(0, elements.comment(lines))
        elements.write(root, self._path)

#!/usr/bin/env python3
"""What `make bench` computes, held against known answers: `make check-bench`. Needs numpy, no other renderer."""

import argparse
import math
import os
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)

import numpy

import contest
import judge
import renderers
import rows
import scene_numbers
import tables

SIGMAS = 4  # of a normal distribution: one in 16000 by chance, with fixed seeds


class Errors(unittest.TestCase):
    """relMSE against the noise that was put in."""

    @staticmethod
    def deviation(estimate):
        """Of 40 estimates: standard errors between their mean and the truth."""
        random = numpy.random.default_rng(5)
        truth = random.uniform(0.2, 2, (64, 64, 3))
        weight = judge.weights(truth, truth)
        expected = (0.01 * weight).mean()
        found = []
        for _ in range(40):
            i = truth + random.normal(0, 0.1, truth.shape)
            a, b = (truth + random.normal(0, 0.05, truth.shape) for _ in range(2))
            found.append(estimate(i, a, b, weight))
        return (numpy.mean(found) - expected) / (numpy.std(found, ddof=1) / math.sqrt(len(found)))

    def test_noise_of_the_reference_does_not_count(self):
        self.assertLess(abs(self.deviation(lambda i, a, b, w: judge.relmse(i, a, b, w, 0))), SIGMAS)

    def test_planted_comparing_with_the_mean_of_both_would_be_noticed(self):
        naive = self.deviation(lambda i, a, b, w: float(((i - (a + b) / 2) ** 2 * w).mean()))
        self.assertGreater(naive, SIGMAS)

    def test_error_of_the_reference(self):
        def of_mean(i, a, b, w):
            return 8 * judge.relmse_of_mean(a, b, w, 0)  # variance 0.0025 / 2, where 0.01 is expected
        self.assertLess(abs(self.deviation(of_mean)), SIGMAS)

    def test_the_worst_pixels_are_left_out(self):
        truth = numpy.ones((100, 100, 3))
        picture = truth.copy()
        picture[3, 5] = 1e6
        self.assertEqual(judge.relmse(picture, truth, truth, judge.weights(truth, truth)), 0)
        self.assertGreater(judge.relmse(picture, truth, truth, judge.weights(truth, truth), 0), 1e6)

    def test_mean(self):
        random = numpy.random.default_rng(6)
        pairs = [judge.mean_and_sigma(*(2 + random.normal(0, 0.3, (2, 32, 32, 3)))) for _ in range(200)]
        expected = 0.3 / math.sqrt(2 * 3 * 32 * 32)
        self.assertLess(abs(numpy.std([p[0] for p in pairs]) / expected - 1), 0.2)
        self.assertLess(abs(numpy.mean([p[1] for p in pairs]) / expected - 1), 0.05)


class Times(unittest.TestCase):
    """Power laws, read where they are known."""

    def points(self, order, times=(0.5, 2, 8)):
        return [(t, 0.01 * t ** order) for t in times]

    def test_between_points(self):
        for order in (-2, -1, -0.7):
            seconds, beyond = judge.time_to(self.points(order), 0.01 * 3 ** order)
            self.assertAlmostEqual(seconds, 3, 9)
            self.assertFalse(beyond)
            self.assertAlmostEqual(judge.error_at(self.points(order), 3)[0], 0.01 * 3 ** order, 12)

    def test_beyond(self):
        seconds, beyond = judge.time_to(self.points(-1), 0.01 / 80)
        self.assertAlmostEqual(seconds, 80, 6)
        self.assertTrue(beyond)
        self.assertAlmostEqual(judge.error_at(self.points(-1), 16)[0], 0.01 / 16, 9)

    def test_extrapolated_orders_are_bounded(self):
        self.assertAlmostEqual(judge.time_to([(1, 1e-2), (2, 0.99e-2)], 0.495e-2)[0], 8, 6)
        self.assertAlmostEqual(judge.time_to([(1, 1), (2, 1e-6)], 0.25e-6)[0], 8, 6)
        self.assertAlmostEqual(judge.error_at([(1, 1), (2, 1e-6)], 4)[0], 0.25e-6, 9)

    def test_the_first_picture_is_good_enough(self):
        self.assertEqual(judge.time_to(self.points(-1), 1), (0.5, False))

    def test_agreement(self):
        for off in (0.981, 1.019):
            self.assertTrue(judge.agree(off, 1))
            self.assertTrue(judge.agree(5 * off, 5))
        for off in (0.979, 1.021):
            self.assertFalse(judge.agree(off, 1))
            self.assertFalse(judge.agree(5 * off, 5))


class Scenes(unittest.TestCase):
    """The numbers that others get."""

    def test_every_scene(self):
        for row in rows.ROWS:
            row.prepare(64)
            scene = scene_numbers.read(row.path, row.parameters)
            self.assertEqual(scene.depth, row.depth)
            self.assertEqual((scene.width, scene.height), (64, 64))
            self.assertEqual(scene.medium is not None, row.fog)
            self.assertTrue(all(0 < spot.cutoff < 20 for spot in scene.spots))
            self.assertEqual(bool(scene.spots), row.fog)

    def test_we_use_our_own_points(self):
        # To us "independent" means independent numbers, which costs the room without fog a factor of 4 and more.
        with open(os.path.join(rows.SCENES, "room.xml"), encoding="utf-8") as file:
            self.assertIn('<default name="sampler" value="ldsampler"/>', file.read())

    def test_room(self):
        scene = scene_numbers.read(rows.ROWS[0].prepare(64).path, {})
        volumes, areas = [], []
        for mesh in scene.meshes[:3]:
            a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
            volumes.append(abs((a * numpy.cross(b, c)).sum() / 6))
            areas.append(numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1).sum() / 2)
        for found, expected in zip(volumes + areas, [600, 1.4 * 2.2 * 1.4, None, 440, 2 * 1.4 ** 2 + 4 * 1.4 * 2.2]):
            if expected:
                self.assertAlmostEqual(found, expected, 9)
        ball = 4 / 3 * math.pi * 0.9 ** 3
        self.assertTrue(0.95 * ball < volumes[2] < ball)  # facets, closed and facing one way

    def test_panel_faces_down(self):
        panel = scene_numbers.read(rows.ROWS[-1].prepare(64).path, {}).meshes[-1]
        normal = numpy.cross(panel.points[1] - panel.points[0], panel.points[3] - panel.points[0])
        numpy.testing.assert_allclose(normal, [0, -4, 0], atol=1e-12)
        self.assertTrue((panel.radiance == 12).all() and (panel.points[:, 1] == 5.98).all())

    def test_frame(self):
        right, up, forward = scene_numbers.frame(*numpy.array([[0, 2.3, 4.8], [0, 2.3, 0], [0, 1, 0]], dtype=float))
        numpy.testing.assert_allclose([right, up, forward], [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-12)


class Contests(unittest.TestCase):
    """The whole of it, with renderers whose errors are known."""

    def run_one(self, modes, plant=""):
        options = argparse.Namespace(clock="wall", seconds=0.05, reference_seconds=0.4, plant=plant, fresh=True,
                                     cores=1)
        row = rows.Row("fake", "open-beam", 2, ("1e-2", 0.5)).prepare(64)
        command = [sys.executable, os.path.join(HERE, "worker_fake.py")]
        everyone = [renderers.Renderer(name, command, None, mode, mode, "") for name, mode in modes.items()]
        self.said = []
        with tempfile.TemporaryDirectory() as folder:
            contenders = contest.Contest(everyone, row, options, folder, self.said.append).run()
        return tables.result(row, contenders, "wall", 0.05)

    def test_errors_are_the_known_ones(self):
        result = self.run_one({"one": ["2"], "two": ["2.01"]})
        for name, value in (("one", 2), ("two", 2.01)):
            points = result["renderers"][name]["modes"][str(value)]["points"]
            self.assertGreater(len(points), 2)
            for p in points:  # 12288 numbers of chi^2, a tenth more for three renders' median
                self.assertAlmostEqual(p["error_of_all"] * p["spp"] * 4.04, 1, delta=0.1)
        self.assertEqual(result["ratios"]["1e-2"]["best_peer"], "two")

    def test_another_mean_is_refused(self):
        result = self.run_one({"one": ["2"], "two": ["2.05"]})
        self.assertIn("refused", result["renderers"]["two"]["failure"])
        self.assertEqual(result["ratios"], {})

    def test_planted_mean_is_refused(self):
        self.assertIn("refused", self.run_one({"one": ["2"], "two": ["2"]}, "two")["renderers"]["two"]["failure"])

    def test_planted_noise_is_measured(self):
        result = self.run_one({"one": ["2"], "two": ["2"]}, "two-noise")
        self.assertGreater(result["renderers"]["two"]["figures"]["error"][0],
                           5 * result["renderers"]["one"]["figures"]["error"][0])

    def test_who_fails_is_left_out(self):
        result = self.run_one({"one": ["2"], "two": ["broken"], "three": ["2"]})
        self.assertIn("as asked", result["renderers"]["two"]["failure"])
        self.assertEqual(result["ratios"]["1e-2"]["best_peer"], "three")
        self.assertIn("failed", tables.table([result], ["one", "two", "three"], "1e-2", 1))


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/env python3
"""Reads an exported model with code of its own and compares where its points fall in its images.

usage: project_exported.py FORMAT EXPORTED COLMAP_TEXT_FOLDER

FORMAT is colmap-binary, nerfstudio, openmvs or bundler, EXPORTED the folder that was exported to. Each point of the
COLMAP text model is projected into each image of its track by that model, the point with the same number of the exported
model by the exported cameras. Prints the number of projections and the largest difference in pixels (first pixel
centre = (0, 0)). The formats are read by their published layouts:
COLMAP format documentation; nerfstudio data conventions; OpenMVS Interface.h version 7; Bundler v0.3 manual.
"""
import json
import pathlib
import struct
import sys

import numpy as np


def distort(model, d, x, y):
    r2 = x * x + y * y
    if model == "fisheye":
        r = np.sqrt(r2)
        theta = np.arctan(r)
        scale = theta * (1 + d[0] * theta**2 + d[1] * theta**4 + d[2] * theta**6 + d[3] * theta**8) / r
        return x * scale, y * scale
    radial = 1 + d[0] * r2 + d[1] * r2 * r2
    p1, p2 = d[2], d[3]
    return (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y))


def rotation(w, x, y, z):
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def look(point, r, t, model, d, fx, fy, cx, cy):
    """Pixel of a point in a camera that looks along +z with y down."""
    x, y, z = r @ point + t
    u, v = distort(model, d, x / z, y / z)
    return np.array([fx * u + cx, fy * v + cy])


class Colmap:
    """cameras: id -> (model, params); images: id -> (name, R, t, camera); points: [(xyz, rgb, [image])]."""
    LAYOUT = {"PINHOLE": 1, "RADIAL": 3, "OPENCV": 4, "OPENCV_FISHEYE": 5}

    def project(self, image, point):
        _, r, t, camera = self.images[image]
        model, p = self.cameras[camera]
        if model == "RADIAL":
            fx, fy, cx, cy, d = p[0], p[0], p[1], p[2], [p[3], p[4], 0, 0]
        else:
            fx, fy, cx, cy = p[:4]
            d = list(p[4:]) + [0] * (8 - len(p))
        kind = "fisheye" if model == "OPENCV_FISHEYE" else "perspective"
        return look(point, r, t, kind, d, fx, fy, cx - 0.5, cy - 0.5)

    @classmethod
    def from_text(cls, folder):
        self = cls()
        rows = lambda name: [l.rstrip("\n") for l in open(folder / name) if not l.startswith("#")]
        self.cameras = {int(r.split()[0]): (r.split()[1], [float(v) for v in r.split()[4:]])
                        for r in rows("cameras.txt")}
        self.images = {}
        for row in rows("images.txt")[::2]:
            w = row.split(maxsplit=9)
            v = [float(s) for s in w[1:8]]
            self.images[int(w[0])] = (w[9], rotation(*v[:4]), np.array(v[4:]), int(w[8]))
        self.points = []
        for row in rows("points3D.txt"):
            w = row.split()
            self.points.append((np.array([float(s) for s in w[1:4]]), [int(s) for s in w[4:7]],
                                [int(s) for s in w[8::2]]))
        return self

    @classmethod
    def from_binary(cls, folder):
        self = cls()
        names = {i: n for n, i in cls.LAYOUT.items()}
        size = {"PINHOLE": 4, "RADIAL": 5, "OPENCV": 8, "OPENCV_FISHEYE": 8}
        f = Bytes(folder / "cameras.bin")
        self.cameras = {}
        for _ in range(f.one("Q")):
            ident, model, _, _ = f.many("<iiQQ")
            self.cameras[ident] = (names[model], f.many(f"<{size[names[model]]}d"))
        f = Bytes(folder / "images.bin")
        self.images = {}
        for _ in range(f.one("Q")):
            ident, *v, camera = f.many("<I7dI")
            name = f.until_zero()
            self.images[ident] = (name, rotation(*v[:4]), np.array(v[4:]), camera)
            keypoints = f.one("Q")
            f.at += 24 * keypoints
        f = Bytes(folder / "points3D.bin")
        self.points = []
        for _ in range(f.one("Q")):
            _, x, y, z, r, g, b, _, length = f.many("<QdddBBBdQ")
            track = f.many(f"<{2 * length}I")
            self.points.append((np.array([x, y, z]), [r, g, b], list(track[::2])))
        return self


class Bytes:
    def __init__(self, path):
        self.data = path.read_bytes()
        self.at = 0

    def many(self, layout):
        values = struct.unpack_from(layout, self.data, self.at)
        self.at += struct.calcsize(layout)
        return values

    def one(self, layout):
        return self.many("<" + layout)[0]

    def matrix(self, rows, columns):
        return np.array(self.many(f"<{rows * columns}d")).reshape(rows, columns)

    def text(self):
        length = self.one("Q")
        self.at += length
        return self.data[self.at - length:self.at].decode()

    def until_zero(self):
        end = self.data.index(0, self.at)
        text = self.data[self.at:end].decode()
        self.at = end + 1
        return text


class Nerfstudio:
    def __init__(self, folder):
        file = json.load(open(folder / "transforms.json"))
        self.images = {}
        for frame in file["frames"]:
            lens = frame if "fl_x" in frame else file
            c2w = np.array(frame["transform_matrix"]) @ np.diag([1, -1, -1, 1])
            fisheye = lens["camera_model"] == "OPENCV_FISHEYE"
            d = [lens[k] for k in (("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2"))]
            self.images[frame["file_path"]] = (np.linalg.inv(c2w), "fisheye" if fisheye else "perspective", d,
                                               lens["fl_x"], lens["fl_y"], lens["cx"] - 0.5, lens["cy"] - 0.5)
        self.points = read_ply(folder / file["ply_file_path"])

    def project(self, name, point):
        w2c, *lens = self.images["images/" + name]
        return look(point, w2c[:3, :3], w2c[:3, 3], *lens)


def read_ply(path):
    data = path.read_bytes()
    end = data.index(b"end_header\n") + 11
    kind = np.dtype([("p", "<f4", 3), ("c", "u1", 3)])
    vertices = np.frombuffer(data[end:], kind)
    return [(v["p"].astype(float), v["c"].tolist()) for v in vertices]


class OpenMvs:
    def __init__(self, folder):
        f = Bytes(folder / "scene.mvs")
        assert f.many("<4sII") == (b"MVSI", 7, 0)
        platforms = []
        for _ in range(f.one("Q")):
            f.text()
            assert f.one("Q") == 1
            f.text(), f.text()
            width, height = f.many("<II")
            assert width > 0 and height > 0
            k, r, c = f.matrix(3, 3), f.matrix(3, 3), f.matrix(3, 1)
            assert (r == np.eye(3)).all() and (c == 0).all()
            poses = [(f.matrix(3, 3), f.matrix(3, 1)[:, 0]) for _ in range(f.one("Q"))]
            platforms.append((k, poses))
        self.images = {}
        self.names = []
        for _ in range(f.one("Q")):
            name = f.text()
            f.text()
            platform, camera, pose, _ = f.many("<4I")
            assert camera == 0
            f.many("<3f")
            assert f.one("Q") == 0
            k, poses = platforms[platform]
            self.images[name] = (k, *poses[pose])
            self.names.append(name)
        points, self.tracks = [], []
        for _ in range(f.one("Q")):
            points.append(np.array(f.many("<3f"), float))
            self.tracks.append([self.names[f.many("<If")[0]] for _ in range(f.one("Q"))])
        assert f.one("Q") == 0
        self.points = [(p, list(f.many("<3B"))[::-1]) for p, _ in zip(points, range(f.one("Q")))]
        assert f.many("<3Q") == (0, 0, 0)
        assert (f.matrix(4, 4) == np.eye(4)).all() and (f.matrix(3, 3) == np.eye(3)).all()
        f.matrix(6, 1)
        assert f.at == len(f.data), "bytes are left over"

    def project(self, name, point):
        k, r, c = self.images["images/" + name]
        p = k @ (r @ (point - c))
        return p[:2] / p[2]


class Bundler:
    def __init__(self, folder):
        names = (folder / "list.txt").read_text().splitlines()
        lines = iter((folder / "bundle.out").read_text().splitlines())
        assert next(lines) == "# Bundle file v0.3"
        cameras, points = (int(s) for s in next(lines).split())
        assert cameras == len(names)
        row = lambda: np.array([float(s) for s in next(lines).split()])
        self.images = {name: (row(), np.array([row(), row(), row()]), row()) for name in names}
        self.points, self.tracks = [], []
        for _ in range(points):
            xyz, rgb, views = row(), [int(s) for s in next(lines).split()], next(lines).split()
            self.points.append((xyz, rgb))
            assert len(views) == 1 + 4 * int(views[0])
            self.tracks.append([names[int(s)] for s in views[1::4]])
        self.names = names

    def project(self, name, point):
        """From the principal point, y up, as Bundler measures."""
        (f, k1, k2), r, t = self.images["images/" + name]
        x, y, z = r @ point + t
        p = -np.array([x, y]) / z
        n = p @ p
        return f * (1 + k1 * n + k2 * n * n) * p


def main():
    kind, exported, text = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    truth = Colmap.from_text(text)
    reader = {"colmap-binary": Colmap.from_binary, "nerfstudio": Nerfstudio, "openmvs": OpenMvs,
              "bundler": Bundler}[kind]
    model = reader(exported)
    assert len(model.points) == len(truth.points), "the number of points differs"
    worst, count = 0.0, 0
    for number, (xyz, rgb, track) in enumerate(truth.points):
        point = model.points[number]
        assert point[1] == rgb, "a colour differs"
        names = [truth.images[i][0] for i in track]
        if hasattr(model, "tracks"):
            assert model.tracks[number] == ["images/" + n for n in names], "a track differs"
        for image, name in zip(track, names):
            expected = truth.project(image, xyz)
            if kind == "colmap-binary":
                assert model.images[image][0] == name
                actual = model.project(image, point[0])
            else:
                actual = model.project(name, point[0])
            if kind == "bundler":
                camera, p = truth.cameras[truth.images[image][3]]
                cx, cy = p[1:3] if camera == "RADIAL" else p[2:4]
                actual = np.array([actual[0] + cx - 0.5, cy - 0.5 - actual[1]])
            worst = max(worst, float(np.abs(actual - expected).max()))
            count += 1
    print(count, worst)


main()

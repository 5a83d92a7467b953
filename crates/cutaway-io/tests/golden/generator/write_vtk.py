"""Unstructured grids as VTK's own writers write them, and what VTK's own readers read from them.

Writes `fixtures/vtk/*` and `golden/vtk.json`. Needs vtk (9.7.2 was used) and numpy.

    python3 write_vtk.py FOLDER_OF_TESTS
"""

import json
import pathlib
import sys

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

TESTS = pathlib.Path(sys.argv[1])
FILES = TESTS / "fixtures" / "vtk"
POINTS = [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (2, 2, 2)]
TETRAHEDRA = [(0, 1, 2, 3), (1, 2, 3, 4)]
TEMPERATURE = [1, 2.5, -3, 4, 5]
goldens = []


def named(array, name):
    array.SetName(name)
    return array


def numbers(name, values, dtype="float32"):
    return named(numpy_to_vtk(np.array(values, dtype), deep=True), name)


def filled(kind, name, values):
    array = named(kind(), name)
    for value in values:
        array.InsertNextValue(chr(value) if kind is vtk.vtkCharArray else value)
    return array


def grid(points=(), cells=(), fields=(), kinds=None):
    """Two tetrahedra, or cells of other kinds: (VTK's number, points)."""
    g, p = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    kinds = kinds or [(vtk.VTK_TETRA, c) for c in TETRAHEDRA]
    count = 1 + max(i for _, c in kinds for i in c)
    for i in range(count):
        p.InsertNextPoint(POINTS[i] if count == 5 else CORNERS[i])
    g.SetPoints(p)
    for kind, c in kinds:
        g.InsertNextCell(kind, len(c), c)
    for data, arrays in ((g.GetPointData(), points), (g.GetCellData(), cells), (g.GetFieldData(), fields)):
        for array in arrays:
            data.AddArray(array)
    return g


# Corners of three cubes on top of one another, and two tips.
CORNERS = [(x, y, z) for z in range(4) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))] + [(0.5, 0.5, 4), (2, 0.5, 0.5)]


def remember(name, array, on="points", **more):
    """What VTK reads: the values of an array, point by point or cell by cell."""
    path = str(FILES / name)
    if name.endswith(".vtu"):
        r = vtk.vtkXMLUnstructuredGridReader()
    else:
        r = vtk.vtkUnstructuredGridReader()
        for what in ("Scalars", "Vectors", "Normals", "Tensors", "TCoords", "Fields", "ColorScalars"):
            getattr(r, f"ReadAll{what}On")()
    r.SetFileName(path)
    r.Update()
    g = r.GetOutput()
    data = g.GetPointData() if on == "points" else g.GetCellData()
    found = data.GetArray(array)
    values = [found.GetComponent(i, 0) for i in range(found.GetNumberOfTuples())]
    assert found.GetNumberOfTuples() == (g.GetNumberOfPoints() if on == "points" else g.GetNumberOfCells()), name
    goldens.append({"file": name, "array": array, "on": on, "points": g.GetNumberOfPoints(), "values": values, **more})


def legacy(name, g, arrays=("temperature",), binary=False, version=51, on="points", **more):
    w = vtk.vtkUnstructuredGridWriter()
    w.SetInputData(g)
    w.SetFileName(str(FILES / name))
    w.SetFileTypeToBinary() if binary else w.SetFileTypeToASCII()
    w.SetFileVersion(version)
    assert w.Write() == 1
    for array in arrays:
        remember(name, array, on, **more)


def xml(name, g, arrays=("temperature",), mode="binary", compressor="None", header=32, big=False, on="points", ids=64,
        block=None, steps=None, pieces=1, **more):
    w = vtk.vtkXMLUnstructuredGridWriter()
    w.SetInputData(g)
    w.SetFileName(str(FILES / name))
    {"text": w.SetDataModeToAscii, "binary": w.SetDataModeToBinary}.get(mode, w.SetDataModeToAppended)()
    w.SetEncodeAppendedData(0 if mode == "raw" else 1)
    getattr(w, f"SetCompressorTypeTo{compressor}")()
    w.SetHeaderTypeToUInt64() if header == 64 else w.SetHeaderTypeToUInt32()
    w.SetByteOrderToBigEndian() if big else w.SetByteOrderToLittleEndian()
    w.SetIdTypeToInt32() if ids == 32 else w.SetIdTypeToInt64()
    w.SetNumberOfPieces(pieces)
    if block:
        w.SetBlockSize(block)
    if steps:
        w.SetInputData(steps[0][1])
        w.SetNumberOfTimeSteps(len(steps))
        w.Start()
        for time, step in steps:
            w.SetInputData(step)
            w.WriteNextTime(time)
        w.Stop()
        for k in range(len(steps)):
            # VTK 9.7.2 does not read back any step but the first.
            expected = [v + k for v in TEMPERATURE]
            goldens.append({"file": name, "array": "temperature", "on": on, "points": 5, "values": expected, "step": k})
        return
    assert w.Write() == 1
    for array in arrays:
        remember(name, array, on, **more)


def matrix():
    """Every way to encode one array."""
    g = grid([numbers("temperature", TEMPERATURE)])
    xml("text.vtu", g, mode="text")
    for mode in ("binary", "appended", "raw"):
        for compressor in ("None", "ZLib", "LZ4", "LZMA"):
            for header in (32, 64):
                for big in (False, True):
                    name = f"{mode}-{compressor.lower()}-{header}{'-be' if big else ''}.vtu"
                    xml(name, g, mode=mode, compressor=compressor, header=header, big=big)
    for binary in (False, True):
        for version in (42, 51):
            legacy(f"{'binary' if binary else 'text'}-{version}.vtk", g, binary=binary, version=version)
    xml("ids-32.vtu", g, ids=32)


def types():
    """Every type of numbers, all in one file, each read by its name."""
    kinds = [vtk.vtkCharArray, vtk.vtkSignedCharArray, vtk.vtkUnsignedCharArray, vtk.vtkShortArray, vtk.vtkUnsignedShortArray,
             vtk.vtkIntArray, vtk.vtkUnsignedIntArray, vtk.vtkLongArray, vtk.vtkUnsignedLongArray, vtk.vtkLongLongArray,
             vtk.vtkUnsignedLongLongArray, vtk.vtkIdTypeArray, vtk.vtkFloatArray, vtk.vtkDoubleArray, vtk.vtkBitArray]
    arrays = [named(vtk.vtkStringArray(), "words")]
    for word in ("a", "two words", "", "%", "x" * 70):
        arrays[0].InsertNextValue(word)
    for kind in kinds:
        values = (1, 0, 1, 1, 0) if kind is vtk.vtkBitArray else (3, 1, 4, 120, 5)
        arrays.append(filled(kind, kind.__name__[3:-5], values))
    names = [kind.__name__[3:-5] for kind in kinds]
    g = grid(arrays)
    for version in (42, 51):
        legacy(f"types-text-{version}.vtk", g, names, version=version)
        legacy(f"types-binary-{version}.vtk", g, names, binary=True, version=version)
    for mode in ("text", "binary", "raw"):
        xml(f"types-{mode}.vtu", g, names, mode=mode)
    xml("types-zlib.vtu", g, names, mode="appended", compressor="ZLib", big=True)


def attributes():
    """Attributes of every kind around the wanted array."""
    vector = lambda name, n: numbers(name, np.arange(5 * n).reshape(5, n))
    for binary in (False, True):
        t = "binary" if binary else "text"
        g = grid([vector("other", 2)], fields=[filled(vtk.vtkDoubleArray, "TimeValue", [12.5])])
        data = g.GetPointData()
        data.SetScalars(numbers("temperature", TEMPERATURE))
        data.SetVectors(vector("velocity", 3))
        data.SetNormals(vector("normal", 3))
        data.SetTCoords(vector("place", 2))
        data.SetTensors(vector("stress", 9))
        data.SetGlobalIds(filled(vtk.vtkIdTypeArray, "GlobalIds", range(5)))
        data.SetPedigreeIds(filled(vtk.vtkStringArray, "origin", ["a", "b c", "", "d", "e"]))
        for version in (42, 51):
            legacy(f"attributes-{t}-{version}.vtk", g, binary=binary, version=version)
        # Colours as active scalars, with a table.
        colors = grid([numbers("temperature", TEMPERATURE)])
        rgb = numbers("colour", np.arange(15).reshape(5, 3) * 17, "uint8")
        colors.GetPointData().SetScalars(rgb)
        legacy(f"colours-{t}.vtk", colors, binary=binary)
        table = grid([numbers("pressure", [9, 8, 7, 6, 5])])
        active = numbers("temperature", TEMPERATURE)
        lut = vtk.vtkLookupTable()
        lut.SetNumberOfTableValues(4)
        lut.Build()
        active.SetLookupTable(lut)
        table.GetPointData().SetScalars(active)
        legacy(f"table-{t}.vtk", table, binary=binary)
    # VTK 9.7.2 crashes where the pedigree is text.
    g.GetPointData().SetPedigreeIds(filled(vtk.vtkIdTypeArray, "origin", range(5)))
    xml("attributes.vtu", g, mode="appended")


def keys():
    """Keys and names of components, which become METADATA and InformationKey."""
    arrays = [numbers("temperature", TEMPERATURE), numbers("pressure", [10, 20, 30, 40, 50]),
              numbers("a velocity, 100 %", np.arange(15).reshape(5, 3)), numbers("größe", [5, 4, 3, 2, 1])]
    for array in arrays:
        array.GetRange()
        array.GetInformation().Set(vtk.vtkDataArray.UNITS_LABEL(), "K")
    for i, name in enumerate(("x x", "y", "z")):
        arrays[2].SetComponentName(i, name)
    material = numbers("material", [3, 8], "int32")
    material.GetRange()
    title = filled(vtk.vtkStringArray, "title", ["two cells", "and a second line\nin it"])
    g = grid(arrays, [material], [filled(vtk.vtkDoubleArray, "TimeValue", [12.5]), title])
    names = ("temperature", "pressure", "größe")
    for binary in (False, True):
        for version in (42, 51):
            name = f"keys-{'binary' if binary else 'text'}-{version}.vtk"
            legacy(name, g, names, binary=binary, version=version)
            remember(name, "material", "cells")
    for mode in ("text", "binary", "appended", "raw"):
        xml(f"keys-{mode}.vtu", g, names, mode=mode)
        remember(f"keys-{mode}.vtu", "material", "cells")


def cells():
    """Values on cells, alone."""
    g = grid([], [numbers("material", [3, 8])])
    for binary in (False, True):
        for version in (42, 51):
            legacy(f"cells-{'binary' if binary else 'text'}-{version}.vtk", g, ["material"], binary, version, "cells")
    xml("cells-text.vtu", g, ["material"], "text", on="cells")
    xml("cells-lz4.vtu", g, ["material"], "raw", "LZ4", on="cells")
    active = grid([numbers("velocity", np.arange(15).reshape(5, 3))], [numbers("first", [1, 2])])
    active.GetCellData().SetScalars(numbers("material", [3, 8]))
    legacy("cells-active.vtk", active, ["material"], on="cells")
    xml("cells-active.vtu", active, ["material"], on="cells")


def steps():
    """Several time steps in one file."""
    all_steps = [(0.5 * k, grid([numbers("temperature", [v + k for v in TEMPERATURE])], [numbers("material", [k, 8])]))
                 for k in range(3)]
    for mode in ("text", "binary", "appended", "raw"):
        xml(f"steps-{mode}.vtu", None, mode=mode, steps=all_steps)
    xml("steps-zlib.vtu", None, mode="appended", compressor="ZLib", steps=all_steps)


def shapes():
    """Other cells than tetrahedra."""
    cube = tuple(range(8))
    kinds = [(vtk.VTK_HEXAHEDRON, cube), (vtk.VTK_VOXEL, (4, 5, 7, 6, 8, 9, 11, 10)), (vtk.VTK_WEDGE, (8, 9, 10, 12, 13, 14)),
             (vtk.VTK_PYRAMID, (12, 13, 14, 15, 16)), (vtk.VTK_TETRA, (1, 2, 5, 17)), (vtk.VTK_TRIANGLE, (0, 1, 2)),
             (vtk.VTK_LINE, (0, 1)), (vtk.VTK_VERTEX, (3,))]
    count = 18
    g = grid([numbers("temperature", range(count))], kinds=kinds)
    legacy("shapes-42.vtk", g, binary=True, version=42)
    legacy("shapes-51.vtk", g)
    xml("shapes.vtu", g, mode="appended", compressor="ZLib")
    # Many small blocks, the last not full.
    many = grid([numbers("temperature", np.arange(count) * 0.25, "float64")], kinds=kinds)
    for compressor in ("ZLib", "LZ4", "LZMA"):
        xml(f"blocks-{compressor.lower()}.vtu", many, mode="appended", compressor=compressor, block=32)


def ghosts():
    """Cells and points that other pieces own."""
    ghost = numbers("vtkGhostType", [0, 1], "uint8")
    g = grid([numbers("temperature", TEMPERATURE), numbers("vtkGhostType", [0, 0, 0, 0, 1], "uint8")], [ghost])
    legacy("ghosts.vtk", g)
    xml("ghosts.vtu", g)
    empty = vtk.vtkUnstructuredGrid()
    empty.SetPoints(vtk.vtkPoints())
    for name, writer in (("empty.vtk", vtk.vtkUnstructuredGridWriter), ("empty.vtu", vtk.vtkXMLUnstructuredGridWriter)):
        w = writer()
        w.SetInputData(empty)
        w.SetFileName(str(FILES / name))
        w.Write()


FILES.mkdir(parents=True, exist_ok=True)
for write in (matrix, types, attributes, keys, cells, steps, shapes, ghosts):
    write()
with open(TESTS / "golden" / "vtk.json", "w", encoding="utf-8") as out:
    out.write("[\n" + ",\n".join(json.dumps(g, ensure_ascii=False) for g in goldens) + "\n]\n")
print(len(goldens), sum(f.stat().st_size for f in FILES.iterdir()))

using System;
using System.Diagnostics;
using System.Globalization;
using Upt;
using Upt.Interop;
using UnityEngine;

/// <summary>
/// What the C# side adds to the library: a call, a frame's upload, garbage. Prints a <c>ROW {json}</c> a line for
/// `cargo xtask bench`. The mesh is the stub's: sampling, the change of axes and one copy are timed, not the engine's
/// transfer to the graphics card and not its normals.
/// </summary>
internal static class Overhead
{
    private const int Turns = 21;

    private static int Main(string[] arguments)
    {
        using (Model model = new Model(arguments[0], 1))
        using (Scene scene = new Scene(model))
        {
            Row("call/without arguments", 1e9 * Seconds(() => Native.upt_abi_version()), "ns", null);
            Row("call/statistics through a handle", 1e9 * Seconds(() => scene.Stats()), "ns", null);
            uint[] nodes = model.Indices(Native.UPT_SET_DOMAIN_NODES);
            Array.Resize(ref nodes, 20);
            float[] vectors = new float[60];
            for (int i = 2; i < 60; i += 3) vectors[i] = -5f;
            for (int i = 0; i < 10; i++) scene.Step(StepInput.OfContacts(nodes, vectors, 20), null);
            foreach (int count in new[] { 16384, 65536 }) Frame(model, scene, count);
            Row("garbage of a step", Garbage(() => scene.Step(StepInput.OfContacts(nodes, vectors, 20), null)), "bytes", 0.0);
        }
        return 0;
    }

    private static void Frame(Model model, Scene scene, int count)
    {
        const float scale = 0.001f;
        float[] positions = model.Positions();
        uint[] surface = model.Indices(Native.UPT_SET_SURFACE_NODES);
        Vector3[] vertices = new Vector3[count];
        for (int i = 0; i < count; i++)
        {
            long at = 3L * surface[i % surface.Length];
            vertices[i] = Anatomical.ToUnity(positions[at], positions[at + 1], positions[at + 2], scale);
        }
        Mesh source = new Mesh();
        source.vertices = vertices;
        using (SurfaceMesh mesh = new SurfaceMesh(model, source, scale))
        {
            scene.AttachPoints(mesh.PointsInBundle());
            string name = "frame/" + count + " vertices";
            Action frame = () =>
            {
                mesh.Sample(scene, 0.5);
                mesh.Upload(false);
            };
            Row(name, 1e3 * Seconds(frame), "ms", null);
            Row(name + ", garbage", Garbage(frame), "bytes", 0.0);
        }
    }

    /// <summary>Median time of a call.</summary>
    private static double Seconds(Action call)
    {
        call();
        Stopwatch watch = Stopwatch.StartNew();
        call();
        int calls = (int)Math.Max(1, Math.Min(100000, 0.01 / Math.Max(1e-7, watch.Elapsed.TotalSeconds)));
        double[] times = new double[Turns];
        for (int turn = 0; turn < Turns; turn++)
        {
            watch = Stopwatch.StartNew();
            for (int i = 0; i < calls; i++) call();
            times[turn] = watch.Elapsed.TotalSeconds / calls;
        }
        Array.Sort(times);
        return times[Turns / 2];
    }

    /// <summary>Managed bytes a call, over a thousand.</summary>
    private static double Garbage(Action call)
    {
        call();
        GC.Collect();
        GC.WaitForPendingFinalizers();
        long before = GC.GetTotalMemory(true);
        int collections = GC.CollectionCount(0);
        for (int i = 0; i < 1000; i++) call();
        long after = GC.GetTotalMemory(false);
        if (GC.CollectionCount(0) != collections) throw new InvalidOperationException("a collection ran: garbage is made");
        return Math.Max(0, after - before) / 1000.0;
    }

    private static void Row(string name, double value, string unit, double? bar)
    {
        string number = value.ToString("R", CultureInfo.InvariantCulture);
        string limit = bar.HasValue ? bar.Value.ToString("R", CultureInfo.InvariantCulture) : "null";
        Console.WriteLine("ROW {\"name\":\"unity/" + name + "\",\"value\":" + number + ",\"unit\":\"" + unit +
                          "\",\"against\":null,\"ratio\":null,\"error\":null,\"bar\":" + limit + ",\"goal\":null}");
    }
}

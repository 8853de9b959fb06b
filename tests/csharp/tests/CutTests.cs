using System;
using NUnit.Framework;
using Upt.Interop;

namespace Upt.Tests
{
    /// <summary>A body that is cut: outputs and the surface grow, and a snapshot from before is undo.</summary>
    [TestFixture]
    public sealed class CutTests
    {
        /// <summary>A blade that goes from above a box through its upper part, off its middle.</summary>
        private static float[] Blade(float[] rest)
        {
            float[] low = { rest[0], rest[1], rest[2] }, high = { rest[0], rest[1], rest[2] };
            for (int k = 0; k < rest.Length; k++)
            {
                low[k % 3] = Math.Min(low[k % 3], rest[k]);
                high[k % 3] = Math.Max(high[k % 3], rest[k]);
            }
            float x = low[0] + 0.45f * (high[0] - low[0]), z = low[2] + 0.6f * (high[2] - low[2]);
            float top = high[2] + 1, front = low[1] - 1, back = high[1] + 1;
            return new[] { x, front, top, x, back, top, x, front, z, x, back, z };
        }

        [Test]
        public unsafe void TheSurfaceOfACutBodyGrowsAndFollows()
        {
            string bundle = Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED");
            Assert.That(bundle, Is.Not.Null.And.Not.Empty, "UPT_TEST_CORRECTED is not set: run tests/csharp/run.sh");
            using (Model model = new Model(bundle, 1))
            using (Scene scene = new Scene(model, new upt_scene_options { corrections = Corrections.Count(5) }))
            {
                float[] rest = model.Positions();
                float[] blade = Blade(rest);
                CutSurface surface = new CutSurface();
                Assert.That(scene.UpdateSurface(surface) && surface.IsNew);
                int triangles = surface.Inside.Length;
                Assert.That(surface.Changed.Length, Is.EqualTo(triangles));
                Assert.That(surface.Inside, Has.All.EqualTo((byte)0));
                Assert.That(scene.UpdateSurface(surface), Is.False);
                byte[] saved = scene.Save();

                Assert.Throws<ArgumentException>(() => scene.Cut(0, blade, 5));
                upt_cut made = scene.Cut(0, blade, 2);
                Assert.That(made.copied_count, Is.GreaterThan(0));
                Assert.That(scene.NodeCount, Is.EqualTo(model.NodeCount + (int)made.copied_count));
                Assert.That(scene.RegionCount, Is.EqualTo(scene.NodeCount));
                UptException stale = Assert.Throws<UptException>(() => scene.SurfacePositions(new float[rest.Length]));
                Assert.That(stale.Status, Is.EqualTo(Native.UPT_ERR_STATE));
                Assert.That(scene.UpdateSurface(surface) && !surface.IsNew);
                Assert.That(surface.FirstVertex, Is.EqualTo(model.NodeCount));
                Assert.That(surface.Inside, Has.Some.EqualTo((byte)1));

                float[] field = new float[3 * scene.NodeCount];
                scene.Step(default(StepInput), field);
                float[] at = new float[surface.Rest.Length];
                scene.SurfacePositions(at);
                for (int k = 0; k < rest.Length; k++) Assert.That(at[k], Is.EqualTo(rest[k] + field[k]).Within(1e-4f));

                Assert.That(scene.Tear(1, 5f, 4).area_mm2, Is.EqualTo(0f));
                Assert.Throws<UptException>(() => scene.Tear(1, 1f, 4));
                Assert.That(scene.ScaleStiffness(new uint[] { 0 }, 2f).node_count, Is.EqualTo((ulong)scene.NodeCount));
                Assert.That(scene.DropFragments().node_count, Is.EqualTo((ulong)scene.NodeCount));
                upt_instrument ball = default(upt_instrument);
                ball.radius = 2f;
                ball.rotation[3] = 1f;
                ball.position[0] = blade[0];
                ball.position[1] = 0.5f * (blade[1] + blade[4]);
                ball.position[2] = blade[2] - 1;
                Assert.That(scene.Remove(ball, 5f).removed_mm3, Is.GreaterThan(0f));

                scene.Restore(saved);
                Assert.That(scene.NodeCount, Is.EqualTo(model.NodeCount));
                Assert.That(scene.UpdateSurface(surface) && surface.IsNew);
                Assert.That(surface.Inside.Length, Is.EqualTo(triangles));
            }
        }
    }
}

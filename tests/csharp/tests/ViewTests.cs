using System;
using NUnit.Framework;
using Upt.Interop;

namespace Upt.Tests
{
    /// <summary>What a call gives back, by a view; instruments of each shape.</summary>
    [TestFixture]
    public sealed unsafe class ViewTests
    {
        [Test]
        public void APointAtANodeGoesWhereTheNodeGoes()
        {
            string bundle = Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED");
            Assert.That(bundle, Is.Not.Null.And.Not.Empty, "UPT_TEST_CORRECTED is not set: run tests/csharp/run.sh");
            using (Model model = new Model(bundle, 1))
            using (Scene scene = new Scene(model, new upt_scene_options { corrections = Corrections.Count(5) }))
            using (Hull hull = new Hull(Cube(5f)))
            {
                float[] rest = model.Positions();
                uint node = model.Indices(Native.UPT_SET_DOMAIN_NODES)[0];
                float[] point = { rest[3 * node], rest[3 * node + 1], rest[3 * node + 2] };
                scene.AttachPoints(point);
                upt_instrument[] tools = {
                    Instruments.Sphere(3f).At(4900f, 0f, 0f), Instruments.Capsule(2f, 4f).At(5000f, 0f, 0f),
                    Instruments.Box(1f, 2f, 3f).At(5100f, 0f, 0f), Instruments.Spatula(1f, 2f, 3f, 0.5f).At(5200f, 0f, 0f),
                    Instruments.OfHull(hull).At(5300f, 0f, 0f),
                };
                float[] field = new float[3 * scene.NodeCount];
                scene.Step(StepInput.OfInstruments(tools, tools.Length), field);
                scene.Readings(new upt_instrument_reading[tools.Length], tools.Length);
                scene.Step(StepInput.OfContacts(new[] { node }, new[] { 0.5f, 0f, 0f }, 1), field);
                float[] read = new float[3], sampled = new float[3], decoded = new float[3];
                fixed (float* r = read, s = sampled)
                {
                    scene.Read(Native.UPT_VIEW_POINTS, r, 3);
                    scene.Sample(1.0, Native.UPT_VIEW_POINTS, s, 3);
                }
                scene.Decode(new[] { node }, decoded);
                for (int axis = 0; axis < 3; axis++)
                {
                    Assert.That(decoded[axis], Is.EqualTo(field[3 * node + axis]));
                    Assert.That(read[axis], Is.EqualTo(decoded[axis]).Within(1e-4f));
                    Assert.That(sampled[axis], Is.EqualTo(read[axis]));
                }
                Assert.That(Math.Abs(field[3 * node]) + Math.Abs(field[3 * node + 1]) + Math.Abs(field[3 * node + 2]),
                            Is.GreaterThan(0.1f));
                UptException refused = Assert.Throws<UptException>(() => ReadNodes(scene, read));
                Assert.That(refused.Status, Is.EqualTo(Native.UPT_ERR_UNSUPPORTED));
                Assert.That(refused.Message, Is.StringContaining("view.kind"));
            }
        }

        private static float[] Cube(float half)
        {
            float[] points = new float[24];
            for (int i = 0; i < points.Length; i++) points[i] = (i / 3 >> i % 3) % 2 == 0 ? half : -half;
            return points;
        }

        private static void ReadNodes(Scene scene, float[] room)
        {
            fixed (float* r = room) scene.Read(Native.UPT_VIEW_NODES, r, room.Length);
        }
    }
}

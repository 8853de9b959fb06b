using System;
using NUnit.Framework;
using Upt.Interop;

namespace Upt.Tests
{
    /// <summary>Loads beside contact: forces on nodes, pressure, gravity, a support that moves.</summary>
    [TestFixture]
    public sealed class LoadTests
    {
        private static float[] After(StepInput input, int steps, bool submitted)
        {
            string bundle = Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED");
            Assert.That(bundle, Is.Not.Null.And.Not.Empty, "UPT_TEST_CORRECTED is not set: run tests/csharp/run.sh");
            using (Model model = new Model(bundle, 1))
            using (Scene scene = new Scene(model, new upt_scene_options { corrections = Corrections.Count(5) }))
            {
                float[] field = new float[3 * scene.NodeCount];
                for (int step = 0; step < steps; step++)
                {
                    if (submitted)
                    {
                        scene.Submit(input);
                        Assert.That(scene.Wait(60000));
                        scene.Read(field);
                    }
                    else scene.Step(input, field);
                }
                return field;
            }
        }

        private static uint[] Domain(out int nodes)
        {
            using (Model model = new Model(Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED"), 1))
            {
                nodes = model.NodeCount;
                return model.Indices(Native.UPT_SET_DOMAIN_NODES);
            }
        }

        [Test]
        public void AForceMovesItsNodeItsOwnWay()
        {
            int nodes;
            uint node = Domain(out nodes)[0];
            StepInput input = new StepInput { Forces = new float[3 * nodes] };
            input.Forces[3 * node + 2] = 20f;
            float[] field = After(input, 8, false);
            Assert.That(field[3 * node + 2], Is.GreaterThan(1e-3f));
            Assert.That(After(input, 8, true), Is.EqualTo(field));
            input.Forces[3 * node + 2] = -20f;
            Assert.That(After(input, 8, false)[3 * node + 2], Is.LessThan(-1e-3f));
            input.Forces = new float[3];
            Assert.Throws<ArgumentException>(() => After(input, 1, false));
        }

        [Test]
        public void AForceAtAPointIsThatOfItsNodes()
        {
            int nodes;
            Domain(out nodes);
            upt_point_force[] points;
            StepInput shared = new StepInput { Forces = new float[3 * nodes] };
            using (Model model = new Model(Environment.GetEnvironmentVariable("UPT_TEST_CORRECTED"), 1))
            {
                float[] positions = model.Positions();
                float[] middle = new float[3];
                uint[] tets = model.Indices(Native.UPT_SET_TETS);
                for (int i = 0; i < 12; i++) middle[i % 3] += 0.25f * positions[3 * tets[i / 3] + i % 3];
                points = model.Locate(middle);
                Assert.Throws<ArgumentException>(() => model.Locate(new float[2]));
            }
            Assert.That(points.Length, Is.EqualTo(1));
            unsafe
            {
                fixed (upt_point_force* point = points)
                {
                    point->force[2] = 20f;
                    for (int k = 0; k < 4; k++)
                    {
                        Assert.That(point->weights[k], Is.EqualTo(0.25f).Within(1e-3f));
                        shared.Forces[3 * point->nodes[k] + 2] = 20f * point->weights[k];
                    }
                }
            }
            Assert.That(After(new StepInput { PointForces = points }, 4, true), Is.EqualTo(After(shared, 4, false)));
        }

        [Test]
        public void PressureOnAListOfNodesIsThatOnTheDomain()
        {
            int nodes;
            uint[] domain = Domain(out nodes);
            StepInput input = new StepInput { Pressures = new[] { new Pressure { Pascal = 30f } } };
            float[] whole = After(input, 8, false);
            Assert.That(whole, Has.Some.GreaterThan(1e-4f).Or.Some.LessThan(-1e-4f));
            // Half of it twice, on the same nodes by name; and submitted.
            Pressure half = new Pressure { Pascal = 15f, Nodes = domain };
            StepInput named = new StepInput { Pressures = new[] { half, half } };
            float[] twice = After(named, 8, true);
            for (int k = 0; k < whole.Length; k++) Assert.That(twice[k], Is.EqualTo(whole[k]).Within(1e-4f));
            Assert.Throws<ArgumentException>(() => After(new StepInput { Pressures = new Pressure[33] }, 1, false));
        }

        [Test]
        public void ATurnedSupportIsTurnedGravity()
        {
            StepInput turned = new StepInput { Gravity = (0f, -1f, 0f), GravityAtRest = (0f, 0f, -1f) };
            float[] field = After(turned, 40, false);
            Assert.That(field, Has.Some.GreaterThan(1e-4f).Or.Some.LessThan(-1e-4f));
            // By 90 degrees about x: the world's -z is -y in the mesh's frame then.
            float half = (float)Math.Sqrt(0.5);
            StepInput support = new StepInput { Gravity = (0f, 0f, -1f), GravityAtRest = (0f, 0f, -1f),
                                                SupportRotation = (half, 0f, 0f, half) };
            float[] carried = After(support, 40, false);
            for (int k = 0; k < field.Length; k++) Assert.That(carried[k], Is.EqualTo(field[k]).Within(2e-2f));
        }
    }
}

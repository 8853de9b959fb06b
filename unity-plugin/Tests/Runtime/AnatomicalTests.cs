using NUnit.Framework;
using UnityEngine;

namespace Upt.Tests
{
    /// <summary>Axes and units between Unity and the bundle. Runs in Unity's test runner and under Mono.</summary>
    public sealed class AnatomicalTests
    {
        [Test]
        public unsafe void AxesMapBackAndForthAndKeepVolumesPositive()
        {
            Vector3 local = Anatomical.ToUnity(1f, 2f, 3f, 0.001f);
            float* ras = stackalloc float[4];
            Anatomical.FromUnity(local, 0.001f, ras);
            Assert.That(ras[0], Is.EqualTo(1f).Within(1e-5));
            Assert.That(ras[1], Is.EqualTo(2f).Within(1e-5));
            Assert.That(ras[2], Is.EqualTo(3f).Within(1e-5));
            // A turn about Unity's y, applied to a point, is the mapped turn of the mapped point.
            Quaternion turn = Quaternion.AngleAxis(30f, new Vector3(0.2f, 1f, -0.4f));
            Vector3 turned = turn * local;
            Anatomical.FromUnity(turn, ras);
            Quaternion mapped = new Quaternion(ras[0], ras[1], ras[2], ras[3]);
            Vector3 expected = mapped * new Vector3(1f, 2f, 3f);
            Anatomical.FromUnity(turned, 0.001f, ras);
            Assert.That(ras[0], Is.EqualTo(expected.x).Within(1e-4));
            Assert.That(ras[1], Is.EqualTo(expected.y).Within(1e-4));
            Assert.That(ras[2], Is.EqualTo(expected.z).Within(1e-4));
        }
    }
}

using System;
using System.Collections.Generic;
using NUnit.Framework;
using Upt.Samples;
using UnityEngine;

namespace Upt.Tests
{
    // What the components show in each frame, between the steps.
    public sealed partial class ComponentTests
    {
        /// <summary>Frames until a tool that began inside of the tissue has pushed it out.</summary>
        private const int Begun = 20;

        [Test]
        public void FramesShowTheSpatulaOutsideOfTheTissue()
        {
            PushedBrain sample = Sample();
            SoftTissue tissue = sample.Tissue;
            if (!tissue.Presents) Assert.Ignore("the test bundle has no corrections");
            Transform blade = tissue.instruments[0].transform;
            Vector3 half = tissue.instruments[0].halfExtents;
            Mesh mesh = tissue.GetComponent<MeshFilter>().sharedMesh;
            // Only the domain can be touched.
            HashSet<Vector3> domain = new HashSet<Vector3>(tissue.DomainPoints());
            bool[] touchable = Array.ConvertAll(mesh.vertices, domain.Contains);
            Assert.That(touchable, Has.Some.True);
            int count = touchable.Length, touched = 0;
            float deepest = 0f;
            float usual = Time.deltaTime;
            try
            {
                Play(sample.gameObject, tissue, 160, frame =>
                {
                    touched = Math.Max(touched, tissue.ContactCount);
                    // A tool that was put inside is pushed out over a few steps.
                    bool put = frame < Begun || frame > 90 && frame <= 90 + 2 * Begun;
                    for (int i = 0; i < count && !put; i++)
                    {
                        if (!touchable[i]) continue;
                        Vector3 at = blade.InverseTransformPoint(tissue.transform.TransformPoint(mesh.Shown(i)));
                        float inside = Math.Min(half.x - 1000f * Math.Abs(at.x), half.y - 1000f * Math.Abs(at.y));
                        deepest = Math.Max(deepest, Math.Min(inside, half.z - 1000f * Math.Abs(at.z)));
                    }
                    // Uneven frames, and a second lost.
                    Time.deltaTime = frame == 90 ? 1f : 0.006f + 0.004f * (frame % 4);
                });
            }
            finally
            {
                Time.deltaTime = usual;
            }
            Assert.That(Debug.Errors, Is.Empty);
            Assert.That(touched, Is.GreaterThan(0));
            Assert.That(deepest, Is.LessThan(0.6f), "mm");
            sample.gameObject.SetActive(false);
        }

        [Test]
        public void TheMotionIsSmoothFromFrameToFrame()
        {
            // A steady press of 20 mm/s: no frame may go back, and none may leap by more than a few frames' worth.
            PushedBrain sample = Sample();
            SoftTissue tissue = sample.Tissue;
            sample.depth = 8f;
            sample.period = 1.6f;
            Mesh mesh = tissue.GetComponent<MeshFilter>().sharedMesh;
            Vector3[] rest = mesh.vertices;
            float before = 0f, back = 0f, leap = 0f, deepest = 0f;
            Play(sample.gameObject, tissue, 44, frame =>
            {
                float depth = 0f;
                for (int i = 0; i < rest.Length; i++) depth = Math.Max(depth, (mesh.Shown(i) - rest[i]).magnitude);
                // The sample's spatula begins 2 mm inside of the folds beside its site; they are pushed out first.
                if (frame >= Begun)
                {
                    back = Math.Max(back, before - depth);
                    leap = Math.Max(leap, depth - before);
                }
                deepest = Math.Max(deepest, depth);
                before = depth;
            });
            sample.gameObject.SetActive(false);
            Assert.That(deepest, Is.GreaterThan(0.004f), "the press reached its depth");
            Assert.That(back, Is.LessThan(0.0001f), "a frame went back");
            Assert.That(leap, Is.LessThan(0.0016f), "a frame leapt");
        }

        [Test]
        public void FramesMakeNoGarbage()
        {
            PushedBrain sample = Sample();
            GameObject item = sample.gameObject;
            SoftTissue tissue = sample.Tissue;
            System.Reflection.MethodInfo update = typeof(SoftTissue).GetMethod(
                "Update", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic);
            Action frame = (Action)Delegate.CreateDelegate(typeof(Action), tissue, update);
            for (int i = 0; i < 60; i++) frame();
            int since = GC.CollectionCount(0);
            long before = GC.GetTotalMemory(true);
            since = GC.CollectionCount(0);
            for (int i = 0; i < 600; i++) frame();
            long after = GC.GetTotalMemory(false);
            Console.WriteLine("managed bytes over 600 frames: " + (after - before));
            Assert.That(GC.CollectionCount(0), Is.EqualTo(since));
            Assert.That(after - before, Is.LessThan(64 * 1024));
            item.SetActive(false);
        }
    }
}

using System.Collections.Generic;
using Upt.Interop;
using UnityEngine;

namespace Upt
{
    // What changes the body of the tissue and what holds it: cutters, undo, support groups.
    public sealed partial class SoftTissue
    {
        [Tooltip("Scalpels, scissors and aspirators that work on this tissue. The model needs corrections.")]
        public List<Cutter> cutters = new List<Cutter>();

        [Tooltip("Of what was inside of the organ: faces that a cut has opened. Texture coordinates are the place at rest, three of them, in this object's space. None: the renderer's own.")]
        public Material insideMaterial;

        [Tooltip("Pieces that nothing holds any more leave at the end of a stroke.")]
        public bool dropsFragments = true;

        [Tooltip("Objects that support groups of the model go with.")]
        public List<Support> supports = new List<Support>();

        /// <summary>Strokes that can be undone.</summary>
        private const int MostUndone = 16;

        private CutMesh cutMesh;
        private Material[] materialsBefore;
        private readonly List<byte[]> undone = new List<byte[]>();
        private int strokes;
        private SupportGroup[] groups = new SupportGroup[0];
        private double frameBefore;
        private bool saidRefused;

        /// <summary>Whether the tissue shows the surface of a body that cutters work on.</summary>
        public bool IsCut
        {
            get { return cutMesh != null; }
        }

        /// <summary>Strokes that <see cref="Undo"/> can take back.</summary>
        public int UndoCount
        {
            get { return undone.Count; }
        }

        /// <summary>Puts the body back to what it was before the last stroke of a cutter; false where there is none. Waits for a step in
        /// flight. A cutter that is at work then works again once <see cref="Cutter.active"/> has been off: a blade that is still in the tissue
        /// would begin another stroke at once.</summary>
        public bool Undo()
        {
            if (!IsRunning || undone.Count == 0) return false;
            if (inFlight)
            {
                scene.Wait(uint.MaxValue);
                Collect();
            }
            scene.Restore(undone[undone.Count - 1]);
            undone.RemoveAt(undone.Count - 1);
            foreach (Cutter cutter in cutters)
            {
                if (cutter == null) continue;
                cutter.IsUndone = cutter.IsInStroke;
                cutter.Rest();
            }
            cutMesh.Follow(scene);
            return true;
        }

        /// <summary>Lets the cutters work; no step is in flight.</summary>
        private void Operate()
        {
            for (int i = 0; i < cutters.Count; i++)
            {
                Cutter cutter = cutters[i];
                if (cutter == null) continue;
                if (!cutter.IsReady)
                {
                    if (cutter.IsInStroke) EndStroke(cutter);
                    cutter.IsUndone = false;
                    continue;
                }
                if (cutter.IsUndone) continue;
                bool begins = !cutter.IsInStroke;
                if (begins) BeginStroke(cutter);
                upt_cut made = default(upt_cut);
                try
                {
                    made = cutter.Work(scene, this, cutter.Stroke, begins, clock.Step);
                }
                catch (UptException error)
                {
                    Warn("'" + cutter.name + "' could not work: " + error.Message);
                }
                cutter.Note(made, transform.rotation);
                if (made.node_count > 0) Keep(cutter);
            }
            // Where nothing has changed this does nothing.
            if (cutMesh != null) cutMesh.Follow(scene);
        }

        private void BeginStroke(Cutter cutter)
        {
            if (cutMesh == null)
            {
                // The surface has vertices on all nodes, and points on its lips.
                scene.SetRegion(null);
                scene.AttachPoints(null);
                cutMesh = new CutMesh(unitsPerMillimetre);
                cutMesh.Follow(scene);
                GetComponent<MeshFilter>().sharedMesh = cutMesh.Mesh;
                MeshRenderer renderer = GetComponent<MeshRenderer>();
                if (renderer != null)
                {
                    materialsBefore = renderer.sharedMaterials;
                    Material own = renderer.sharedMaterial;
                    renderer.sharedMaterials = new[] { own, insideMaterial != null ? insideMaterial : own };
                }
            }
            cutter.Stroke = ++strokes;
            cutter.Before = scene.Save();
        }

        /// <summary>A stroke has changed the body: it can be undone.</summary>
        private void Keep(Cutter cutter)
        {
            if (cutter.Before == null) return;
            if (undone.Count == MostUndone) undone.RemoveAt(0);
            undone.Add(cutter.Before);
            cutter.Before = null;
        }

        private void EndStroke(Cutter cutter)
        {
            bool changed = cutter.Before == null;
            cutter.Before = null;
            cutter.Rest();
            if (changed && dropsFragments) scene.DropFragments();
        }

        /// <summary>Whether a scalpel's body is in the slit that its blade cuts.</summary>
        private bool IsInSlit(Instrument instrument)
        {
            for (int i = 0; i < cutters.Count; i++)
            {
                Scalpel scalpel = cutters[i] as Scalpel;
                if (scalpel != null && scalpel.IsWorking && scalpel.body == instrument) return true;
            }
            return false;
        }

        /// <summary>The tissue of this moment, into what is shown.</summary>
        private void Show(int count)
        {
            StepInput input = StepInput.OfInstruments(poses, count);
            input.SupportGroups = Groups(1f);
            Hold(ref input, 1f);
            if (cutMesh != null) cutMesh.Present(scene, clock.Since(now), input);
            else surface.Present(scene, clock.Since(now), input);
        }

        private void Upload()
        {
            if (cutMesh != null) cutMesh.Upload(recalculateNormals);
            else surface.Upload(recalculateNormals);
        }

        /// <summary>The input of the step that begins.</summary>
        private StepInput OfStep()
        {
            StepInput input = StepInput.OfInstruments(stepPoses, submittedCount);
            double frame = now - frameBefore;
            double part = frame > 0.0 ? (clock.StepTime - frameBefore) / frame : 1.0;
            float way = (float)System.Math.Max(0.0, System.Math.Min(1.0, part));
            input.SupportGroups = Groups(way);
            Hold(ref input, way);
            return input;
        }

        private void BeginSupports()
        {
            foreach (Support support in supports)
                if (support != null) support.Begin();
            BeginBeds();
        }

        private void LookAtSupports(float deltaTime)
        {
            frameBefore = now - deltaTime;
            LookAtCarried();
            foreach (Support support in supports)
                if (support != null) support.Look(transform);
        }

        /// <summary>The support groups at a part of the way from the last frame to this one; null: none moves.</summary>
        private SupportGroup[] Groups(float part)
        {
            int count = 0;
            for (int i = 0; i < supports.Count; i++)
                if (supports[i] != null && supports[i].isActiveAndEnabled) count++;
            if (count == 0) return null;
            if (groups.Length != count) groups = new SupportGroup[count];
            count = 0;
            for (int i = 0; i < supports.Count; i++)
                if (supports[i] != null && supports[i].isActiveAndEnabled)
                    groups[count++] = supports[i].At(part, unitsPerMillimetre);
            return groups;
        }

        /// <summary>The intact body is back: the mesh from before the first cut is shown.</summary>
        private void Heal()
        {
            BeginSupports();
            if (cutMesh == null) return;
            CloseCuts();
            scene.SetRegion(touchable);
            scene.AttachPoints(surface.PointsInBundle());
            GetComponent<MeshFilter>().sharedMesh = surface.Mesh;
        }

        private void CloseCuts()
        {
            undone.Clear();
            saidRefused = false;
            foreach (Cutter cutter in cutters)
                if (cutter != null) cutter.Rest();
            if (cutMesh != null) cutMesh.Dispose();
            cutMesh = null;
            MeshRenderer renderer = GetComponent<MeshRenderer>();
            if (renderer != null && materialsBefore != null) renderer.sharedMaterials = materialsBefore;
            materialsBefore = null;
        }

        /// <summary>One line until the tissue starts again.</summary>
        private void Warn(string what)
        {
            if (!saidRefused) Debug.LogWarning("libupt: soft tissue '" + name + "': " + what, this);
            saidRefused = true;
        }
    }
}

using System;
using System.Collections.Generic;
using Upt.Interop;
using UnityEngine;

namespace Upt
{
    /// <summary>A bundle's mesh at rest in a tissue's local space; what gizmos draw and a sample looks up.</summary>
    internal sealed class RestGeometry
    {
        private readonly float[] positions;
        private readonly float scale;
        private readonly uint[] domainFaces;
        private Vector3[] outline;

        public RestGeometry(Model model, float unitsPerMillimetre)
        {
            positions = model.Positions();
            domainFaces = model.Indices(Native.UPT_SET_DOMAIN_FACES);
            scale = unitsPerMillimetre;
        }

        /// <summary>Corners of the trained domain's triangles, 3 a triangle. Allocates.</summary>
        public Vector3[] DomainCorners()
        {
            Vector3[] corners = new Vector3[domainFaces.Length];
            for (int i = 0; i < corners.Length; i++) corners[i] = At(domainFaces[i]);
            return corners;
        }

        /// <summary>The middle of the triangle nearest to the domain's mean corner, and its normal out of the tissue. Both stay as
        /// they are where there is no triangle. Allocates.</summary>
        public void DomainMiddle(ref Vector3 middle, ref Vector3 outward)
        {
            Vector3[] corners = DomainCorners();
            if (corners.Length < 3) return;
            Vector3 mean = Vector3.zero;
            for (int i = 0; i < corners.Length; i++) mean += corners[i];
            mean = mean * (1f / corners.Length);
            int best = 0;
            for (int i = 0; i + 2 < corners.Length; i += 3)
                if ((corners[i] - mean).magnitude < (corners[best] - mean).magnitude) best = i;
            middle = (corners[best] + corners[best + 1] + corners[best + 2]) * (1f / 3f);
            // RAS winding is outward; the exchange of axes turns the cross product round.
            outward = Vector3.Cross(corners[best + 2] - corners[best], corners[best + 1] - corners[best]).normalized;
        }

        /// <summary>The border of the trained domain: 2 ends a line. Made once.</summary>
        public Vector3[] DomainOutline()
        {
            if (outline != null) return outline;
            // An edge of one triangle only is on the border.
            Dictionary<ulong, int> uses = new Dictionary<ulong, int>();
            for (int i = 0; i < domainFaces.Length; i++)
            {
                ulong edge = Edge(i);
                int seen;
                uses.TryGetValue(edge, out seen);
                uses[edge] = seen + 1;
            }
            List<Vector3> ends = new List<Vector3>();
            for (int i = 0; i < domainFaces.Length; i++)
            {
                ulong edge = Edge(i);
                if (uses[edge] != 1) continue;
                ends.Add(At((uint)(edge >> 32)));
                ends.Add(At((uint)edge));
            }
            outline = ends.ToArray();
            return outline;
        }

        /// <summary>Where <paramref name="nodes"/> are with displacements <paramref name="vectors"/>
        /// (<c>[count,3]</c>, mm). Allocates.</summary>
        public Vector3[] Displaced(uint[] nodes, float[] vectors, int count)
        {
            Vector3[] points = new Vector3[count];
            for (int i = 0; i < count; i++)
                points[i] = At(nodes[i]) +
                            Anatomical.ToUnity(vectors[3 * i], vectors[3 * i + 1], vectors[3 * i + 2], scale);
            return points;
        }

        /// <summary>The edge from corner <paramref name="i"/> to the triangle's next, smaller node first.</summary>
        private ulong Edge(int i)
        {
            uint a = domainFaces[i], b = domainFaces[i % 3 == 2 ? i - 2 : i + 1];
            return ((ulong)Math.Min(a, b) << 32) | Math.Max(a, b);
        }

        private Vector3 At(uint node)
        {
            long at = 3L * node;
            return Anatomical.ToUnity(positions[at], positions[at + 1], positions[at + 2], scale);
        }
    }
}

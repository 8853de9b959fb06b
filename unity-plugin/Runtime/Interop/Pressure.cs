namespace Upt.Interop
{
    /// <summary>Pressure on a part of the surface at the end of a step. It follows the surface.</summary>
    public struct Pressure
    {
        /// <summary>From outside, Pa; negative for suction.</summary>
        public float Pascal;

        /// <summary>It acts on the boundary triangles with all corners among these nodes; null: on the domain.</summary>
        public uint[] Nodes;
    }
}

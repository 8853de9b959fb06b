namespace Upt.Interop
{
    /// <summary>
    /// What a support group of the bundle does at the end of a step. A group that no step names is held where it was meshed, or
    /// where it was held again.
    /// </summary>
    public struct SupportGroup
    {
        /// <summary>Its place among the bundle's groups, from 0: <see cref="Model.SupportNodes"/>.</summary>
        public int Group;

        /// <summary>Where it is as a rigid body, mm in the mesh's frame: a node <c>x</c> ends at <c>R x + Position</c>.</summary>
        public (float X, float Y, float Z) Position;

        /// <summary><c>R</c>, a unit quaternion; all zero: none.</summary>
        public (float X, float Y, float Z, float W) Rotation;

        /// <summary>It holds nothing. Held again, it holds its nodes where they are then.</summary>
        public bool LetGo;

        /// <summary><c>[n,3]</c>, mm, instead of a pose: where each of its nodes ends; null: the pose.</summary>
        public float[] Displacements;
    }
}

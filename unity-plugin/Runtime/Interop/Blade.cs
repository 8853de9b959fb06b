namespace Upt.Interop
{
    /// <summary>A blade that feels the tissue that it cuts. All zero: it feels nothing, and cuts whatever way it goes.</summary>
    public struct Blade
    {
        /// <summary>What new area takes, J/m².</summary>
        public float FractureEnergy;

        /// <summary>With how much it must be pushed before a stroke begins to cut, mN, ...</summary>
        public float Threshold;

        /// <summary>... and is, mN.</summary>
        public float Pushed;

        /// <summary>Where its edge is sharp, of any length; zeros: everywhere.</summary>
        public (float X, float Y, float Z) Ahead;
    }
}

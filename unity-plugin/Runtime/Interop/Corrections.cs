namespace Upt.Interop
{
    /// <summary>How many corrections by the elements a step in contact gets: <c>corrections</c> of <c>upt_scene_options</c>.</summary>
    public static class Corrections
    {
        /// <summary>None.</summary>
        public static upt_corrections None
        {
            get { return new upt_corrections { mode = Native.UPT_CORRECTIONS_NONE }; }
        }

        /// <summary>This many, 1 to 64; with a target (mm) or a budget (µs) at most so many.</summary>
        public static upt_corrections Count(uint count, float targetMm = 0f, uint budgetUs = 0)
        {
            return new upt_corrections {
                mode = Native.UPT_CORRECTIONS_COUNT,
                count = count,
                target_mm = targetMm,
                budget_us = budgetUs,
            };
        }

        /// <summary>By one number, as inspectors show it: 0 as the bundle recommends, -1 none, otherwise a count.</summary>
        public static upt_corrections Of(int number, float targetMm = 0f)
        {
            upt_corrections made = number == -1 ? None : number == 0 ? default(upt_corrections) : Count(unchecked((uint)number));
            made.target_mm = targetMm;
            return made;
        }
    }
}

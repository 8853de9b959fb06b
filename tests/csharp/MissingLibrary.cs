using System;
using Upt.Interop;

/// <summary>Run where libupt is not on the library path: prints the message and exits 0.</summary>
internal static class MissingLibrary
{
    private static int Main()
    {
        try
        {
            Library.Verify();
        }
        catch (UptException error)
        {
            Console.WriteLine(error.Message);
            return 0;
        }
        Console.WriteLine("libupt was found, although it should not be here");
        return 1;
    }
}

using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("Upt.Tests")]

// Who does what. On a GPU each invocation stands for one item. Mesa's software driver deals the workgroups out to its
// threads beforehand, one run each, and then waits for the slowest; there a few invocations of each workgroup take one
// item after another until none is left. They are enough for half of them to take all. The last to leave sets the
// cursors back.

override TAKES: bool = false;

const TAKING = 8u; // invocations of each workgroup that take
// Items that one takes at most: the driver ends an invocation's loops after 65535 rounds, all of them counted together.
const QUOTA = 16u;

"""Published problems, solved again. `cases.json` holds their data, the printed answers and the true ones.

Files are named by book, tests by the number of the example. A figure is compared with the true value, recomputed from the
same data, and the printed one is quoted beside it: it must be met within the rounding of its source, or be listed under
`not_met` with the reason in the case's note.

What these scenes cannot say yet, and why:

- wheel geometry and stress: Jindal 19-1 (rim and arms), 19-5 (disc), the rim sections of Khurmi 16.15, 16.17 and 16.18, the
  disc of Uicker 18.2;
- a spring or damper between two moving points: the SUNDIALS slider-crank (idaSlCrank_dns);
- torques that depend on speed: the motor's line of the Shigley press (its two speeds are taken as given), and the run-up
  of the slider-crank with T = 10 - 2.387 omega.
"""

"""How does a standing machine share its weight out on steeper ground? One run for each slope, in a
table.
"""

import testbed

print("slope   feet fl fr rl rr [kN]         ropes left right [kN]   lowest normal force [N]")
for slope_deg in (15, 30, 45):
    changes = [f"terrain.slope_deg={slope_deg}"]
    scenario = testbed.load_scenario("stand_slope_45", changes, duration=1.0)
    with testbed.simulate(scenario) as run:
        while not run.finished:
            run.step(1000)
    feet = (run.truth["foot_load"].mean(axis=0) / 1000.0).round(2)
    ropes = (run.rows["rope_tension"].mean(axis=0) / 1000.0).round(2)
    lowest_n = run.truth["contact_normal"].min()
    print(f"{slope_deg:5}   {feet!s:28}  {ropes!s:22}  {lowest_n:.0f}")

"""Forced response from nothing but two matrices, a dof table and a contact table, read from the
working directory."""

from tipdamp import ContactTable, DryFriction2T, ReducedModel, forced_response

LEVELS = (5.0, 40.0, 60.0)  # N
BAND = (900.0, 1400.0)  # Hz


def main():
    model = ReducedModel.from_files("M.mtx", "K.mtx", dofs="dofs.csv")
    pairs = ContactTable.load("pairs.csv")
    tip = model.displacement_row("blades", 2, [0, 1, 0])  # excited and measured here, along y
    print("level N   peak Hz   um per N   slipping pairs   end")
    for level in LEVELS:
        curve = forced_response(
            model,
            pairs,
            DryFriction2T(),
            level * tip,
            BAND,
            harmonics=5,
            damping_ratio=0.01,
            outputs={"tip": tip},
        )
        hz, amplitude = curve.peak("tip")  # nan, with a warning, where the curve was cut off
        print(
            f"{level:7g} {hz:9.2f} {1e6 * amplitude / level:10.4f} "
            f"{len(curve.slipping_pairs):16d}   {curve.ended}"
        )
        curve.save(f"curve_{level:g}N.npz")


if __name__ == "__main__":
    main()

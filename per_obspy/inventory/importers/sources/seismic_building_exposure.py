"""
SeismicBuildingExposure: surveys of Guatemala and San Jose.

Its ``floor_height`` is in metres in one city and in decimetres in another; it is not used, because
there is ``height``. ``pounding_effect`` is the surveyor's judgement of a possibility, no
observation. Infilled frames and walls have periods of ``other``.
"""

from per_obspy.inventory.importers.importer import Importer

SEISMIC_BUILDING_EXPOSURE = Importer(
    name="SeismicBuildingExposure",
    needed=(("n_storeys", "touches_left", "touches_right", "llrs"),),
    columns={
        "building_id": "id",
        "height": "height",
        "storeys": "n_storeys",
        "occupants": "n_residents",
    },
    systems={
        "CR LFM": "concrete_mrf",
        "S_frame LFM": "steel_mrf",
        "S LFM": "steel_mrf",
        "S LFBR": "ebf_brbf",
    }
    | {
        f"{material} {resisting}": "other"
        for material in ("M", "ADO", "CR", "W")
        for resisting in ("LWAL", "LFINF")
    },
    system_columns=("structural_system", "llrs"),
    carried=(
        "touches_left",
        "touches_right",
        "touches_back",
        "pounding_effect",
        "relative_position",
        "soil_type",
    ),
)

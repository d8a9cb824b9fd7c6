"""Page of the root study: groups of measures, and notes for the reader."""

from eval.study.framework.page import Group, Measure
from eval.study.root.scores import TRAVEL_DISTANCES_M

_TRAJECTORIES = {
    "samples": Measure("windows", "that a training saw"),
    "minutes": Measure("min", "of one core that it took, evaluation on the held-out performer included"),
    "e_mse": Measure(
        "m²", "eq. 3.21 over windows of 10 s in which the true root travels at least 1 m, moved to where the truth is at their start"
    ),
    "e_mse_std": Measure("m²", "its standard deviation over windows"),
    "e_mse_filtered": Measure("m²", "after the filters of flights and feet"),
    "drift": Measure("ratio", "error at the end of a window over the distance travelled"),
    "drift_filtered": Measure("ratio", "after the filters of flights and feet"),
    "distance_ratio": Measure("ratio", "way of the estimate over that of the truth; under 1 it undershoots"),
    "end_error": Measure("cm", "error in the plane at the end of a window"),
    "stairs_error": Measure("cm", "error of the height at the end of stairs (made-up people whom no training saw)"),
}
_SETS = {
    "e_mse_median": Measure("m²", "its median over windows"),
    "e_mse_cmu": Measure("m²", "of cmu/test"),
    "e_mse_bandai": Measure("m²", "of bandai/test"),
    "e_mse_without_slowed": Measure(
        "m²", "without cmu_05_01_mh165, which plays 4.8 times too slowly where a copy of the file says 25 fps instead of 120"
    ),
    "e_mse_turned": Measure("m²", "each window's path turned as a whole onto the truth: without errors of heading"),
    "e_mse_stretched": Measure("m²", "the same, stretched as well: without errors of the steps' length"),
    "e_mse_turned_filtered": Measure("m²", "e_mse_turned after the filters of flights and feet"),
    "e_mse_stretched_filtered": Measure("m²", "e_mse_stretched after the filters of flights and feet"),
    "e_mse_walks": Measure("m²", "of walks"),
    "e_mse_walks_filtered": Measure("m²", "of walks, after the filters of flights and feet"),
    "e_mse_median_filtered": Measure("m²", "its median over windows, after the filters of flights and feet"),
    "e_mse_gaits": Measure("m²", "of walks and runs"),
    "e_mse_dances": Measure("m²", "of dances"),
    "e_mse_on_imu_poses": Measure("m²", "of a model of optical poses on those of simulated suits"),
    "stairs_ratio": Measure("ratio", "height gained or lost on stairs over the true one"),
    "stairs_ratio_filtered": Measure("ratio", "after the filters of flights and feet"),
    "distance_ratio_filtered": Measure("ratio", "after the filters of flights and feet"),
    "stairs_error_filtered": Measure("cm", "after the filters of flights and feet"),
}
_FRAMES = {
    f"{moment}_{axis}": Measure("cm/frame" if axis != "v" else "cm/frame, cm", f"{what} of each frame's {where} error")
    for moment, what in (("mu", "mean"), ("sigma", "standard deviation"))
    for axis, where in (("f", "forward"), ("l", "lateral"), ("v", "vertical"))
}
_HEIGHTS = {
    "height_error_first_half": Measure("cm", "of clips of at least 10 s"),
    "height_error_second_half": Measure("cm", "of the same"),
    "height_error_on_ground": Measure("cm", "of clips with jumps, while the body touches the ground"),
    "height_error_in_air": Measure("cm", "of the same, while its lowest point is more than 5 cm above it"),
}
_WALK = {
    "drift": Measure("ratio", "error at the end over the distance walked, headings equal at the pelvis"),
    "drift_turned": Measure("ratio", "the same, the path turned as a whole onto the truth"),
    "e_mse": Measure("m²", "eq. 3.21, headings equal at the pelvis"),
    "e_mse_turned": Measure("m²", "the same, the path turned as a whole onto the truth"),
    "distance_ratio": Measure("ratio", "way of the estimate over that of the truth"),
}
GROUPS = (
    Group("Trajectories", "Of the network's plain output, without filters.", _TRAJECTORIES),
    Group(
        "Errors of each frame (Table 2.1)",
        "Estimate less truth of the pelvis, along its own axes; models of an absolute height have their vertical error in cm.",
        _FRAMES,
    ),
    Group("Sets of clips, and filters", "Parts of the test clips, and other poses.", _SETS),
    Group(
        "Order of the reconstruction (figure 3.2)",
        "e_mse for each w of F_w (eq. 3.12).",
        {f"e_mse_w{w}": Measure("m²", "") for w in range(8)},
    ),
    Group(
        "Error after so many metres",
        "Distance between estimate and truth once the truth has gone so far from any frame on.",
        {f"error_after_{metres}m": Measure("m", "") for metres in TRAVEL_DISTANCES_M},
    ),
    Group("Heights", "Mean distance between estimated and true height.", _HEIGHTS),
    Group(
        "The real walk",
        "Real accelerations of seven segments, the others from the suit's pose; Vicon's path of the pelvis is the truth (9.55 s, 7.7 m).",
        {f"walk_{name}": measure for name, measure in _WALK.items()},
    ),
    Group(
        "The real walk after the filters",
        "The same where in the air the centre of mass flies, and feet that stand are held.",
        {f"walk_{name}_filtered": measure for name, measure in _WALK.items()},
    ),
    Group(
        "Real and simulated accelerations",
        "Free accelerations that sensors measured, beside those of a simulated suit on the same poses.",
        {
            "real_rms": Measure("m/s²", ""),
            "simulated_rms": Measure("m/s²", ""),
            "difference_rms": Measure("m/s²", ""),
            "correlation": Measure("ratio", ""),
        },
    ),
)
NOTES = (
    "Trained on cmu/train and made-up people, tested on cmu/test and bandai/test: performers that no training saw, each clip through three "
    "simulated suits where poses are a suit's. Accelerations are simulated but on the real walk. Seeds differ in the network and the order "
    "of windows, not in data. The thesis trained for one to two weeks (chapter 2) on data of its own, so its numbers beside ours are a "
    "mark, and a finding counts as reproduced by its direction: two rows differ where they are further apart than their two standard "
    "deviations over seeds together; what is compared within one row, or with a fixed mark, goes by the mean.",
    "All trainings see two takes of each clip and four sets of made-up people, and those of Root3D follow the thesis to the letter: no "
    "support, no sequences, nothing hidden. The models as shipped learnt for longer, from more takes, from poses of both kinds, and from "
    "suits' poses that the restoring network has been through; Root3D as shipped is another network.",
    "All trainings mirror half of their windows and let the learning rate fall, planar ones also hide half of the joints beside the legs: "
    "the thesis has none of that. Root3D rows have its network and loss; the package's own models are the rows as shipped.",
    "Run-walk-idle are the training clips whose kind is run, jog, dash, walk, turn or stand.",
)

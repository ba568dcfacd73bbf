"""Commands of MAVLink missions (MAV_CMD) that do not fly to a place, or that are not supported."""

from typing import Final

#: The start of the landing, to which aircraft may return.
LAND_START: Final = 189
#: A stay at the last waypoint, where a fixed wing circles.
DELAY: Final = 93
#: Commands that only move a camera, a relay or the aircraft's nose, or only wait.
STILL: Final = {
    80: "NAV_ROI",
    DELAY: "NAV_DELAY",
    112: "CONDITION_DELAY",
    114: "CONDITION_DISTANCE",
    115: "CONDITION_YAW",
    181: "DO_SET_RELAY",
    182: "DO_REPEAT_RELAY",
    183: "DO_SET_SERVO",
    184: "DO_REPEAT_SERVO",
    LAND_START: "DO_LAND_START",
    195: "DO_SET_ROI_LOCATION",
    196: "DO_SET_ROI_WPNEXT_OFFSET",
    197: "DO_SET_ROI_NONE",
    200: "DO_CONTROL_VIDEO",
    201: "DO_SET_ROI",
    202: "DO_DIGICAM_CONFIGURE",
    203: "DO_DIGICAM_CONTROL",
    204: "DO_MOUNT_CONFIGURE",
    205: "DO_MOUNT_CONTROL",
    206: "DO_SET_CAM_TRIGG_DIST",
    207: "DO_FENCE_ENABLE",
    211: "DO_GRIPPER",
    212: "DO_AUTOTUNE_ENABLE",
    214: "DO_SET_CAM_TRIGG_INTERVAL",
    220: "DO_MOUNT_CONTROL_QUAT",
    530: "SET_CAMERA_MODE",
    531: "SET_CAMERA_ZOOM",
    532: "SET_CAMERA_FOCUS",
    534: "SET_CAMERA_SOURCE",
    600: "JUMP_TAG",
    1000: "DO_GIMBAL_MANAGER_PITCHYAW",
    1001: "DO_GIMBAL_MANAGER_CONFIGURE",
    2000: "IMAGE_START_CAPTURE",
    2001: "IMAGE_STOP_CAPTURE",
    2003: "DO_TRIGGER_CONTROL",
    2500: "VIDEO_START_CAPTURE",
    2501: "VIDEO_STOP_CAPTURE",
    3000: "DO_VTOL_TRANSITION",
}
#: Frequent commands after which the file does not determine where the aircraft flies.
UNSUPPORTED: Final = {
    30: "NAV_CONTINUE_AND_CHANGE_ALT",
    32: "DO_FOLLOW",
    92: "NAV_GUIDED_ENABLE",
    95: "NAV_LAST",
    176: "DO_SET_MODE",
    177: "DO_JUMP",
    179: "DO_SET_HOME",
    185: "DO_FLIGHTTERMINATION",
    186: "DO_CHANGE_ALTITUDE",
    191: "DO_GO_AROUND",
    192: "DO_REPOSITION",
    193: "DO_PAUSE_CONTINUE",
    208: "DO_PARACHUTE",
    215: "DO_SET_REVERSE",
    222: "DO_GUIDED_LIMITS",
    601: "DO_JUMP_TAG",
}

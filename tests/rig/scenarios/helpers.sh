# What scenarios share; each begins with `. ./helpers.sh`. Runs in the guest, in /run/rig.
set -Eeuo pipefail

settings=/etc/trigmesh/trigmesh.toml
store=/var/lib/trigmesh/sessions
panel=/sys/kernel/config/gpio-sim/rig
vivid_camera=/dev/v4l/by-path/platform-vivid.0-video-index0
uvc_camera=/dev/v4l/by-id/usb-Trigmesh_Rig_camera_0001-video-index0
trap 'echo "$0: line $LINENO failed: $BASH_COMMAND"' ERR

# Waits without a process of its own: in the guest each costs tens of milliseconds.
exec 9<> <(:)
pause() { read -r -t "$1" -u 9 || true; }

fail() {
  echo "FAILED: $*"
  exit 1
}

# wait_until SECONDS WHAT COMMAND..: until the command succeeds; fails with WHAT when it does not in time.
wait_until() {
  local end=$((SECONDS + $1)) what=$2
  shift 2
  until "$@"; do
    [ "$SECONDS" -lt "$end" ] || fail "waited in vain until $what"
    # The guest has nothing that wakes us on any of this; a short pause leaves the processor to the service.
    pause 0.2
  done
}

# ---- the panel: a button on line 3, the light on line 5, the buzzer on line 6
panel_up() {
  modprobe irq_sim
  modprobe gpio-sim
  mkdir -p $panel/bank0/line{3,5,6}
  echo 8 >$panel/bank0/num_lines
  echo rigpanel >$panel/bank0/label
  echo button >$panel/bank0/line3/name
  echo light >$panel/bank0/line5/name
  echo buzzer >$panel/bank0/line6/name
  echo 1 >$panel/live
  udevadm settle
  button=$(line 3)/pull
  let_go
}
line() { echo "/sys/devices/platform/$(cat $panel/dev_name)/$(cat $panel/bank0/chip_name)/sim_gpio$1"; }
push() { echo pull-down >"$button"; }
let_go() { echo pull-up >"$button"; }
# push_for SECONDS
push_for() {
  push
  pause "$1"
  let_go
}
long_push() { push_for 4; }

# ---- cameras
# vivid shows our own pictures on its HDMI input: vivid_up [FRAMES_A_SECOND]
vivid_up() {
  modprobe vivid n_devs=1 node_types=0x101
  udevadm settle
  vivid_connect
  vivid_feed "${1:-5}"
}
vivid_connect() {
  v4l2-ctl -d "$vivid_camera" --set-input=3 --set-ctrl=osd_text_mode=2,loop_video=1 >/dev/null
  v4l2-ctl -d "$(vivid_output)" --set-output=1 --set-dv-bt-timings=index=0 >/dev/null
  v4l2-ctl -d "$vivid_camera" --set-dv-bt-timings=index=0 >/dev/null
}
vivid_output() { readlink -f /dev/v4l/by-path/platform-vivid.0-video-index1; }
vivid_feed() {
  rig_vivid_feeder "$(vivid_output)" feed/feed.yuyv --rate "$1" >feeder.log 2>&1 &
  echo $! >feeder.pid
  wait_until 20 "vivid is fed" grep -q feeding feeder.log
}
vivid_control() { v4l2-ctl -d "$vivid_camera" --set-ctrl="$1" >/dev/null; }

uvc_up() {
  modprobe vhci-hcd
  modprobe uvcvideo
  rig_uvc_camera feed --rate "${1:-5}" >camera.log 2>&1 &
  echo $! >camera.pid
  wait_until 30 "the USB camera is there" test -e "$uvc_camera"
}
uvc_down() {
  kill "$(cat camera.pid)"
  wait_until 30 "the USB camera is gone" test ! -e "$uvc_camera"
}

# ---- the service
# set_key SECTION KEY VALUE: in the settings file, as TOML
set_key() {
  sed -i "/^\[$1\]/,/^\[/ s|^$2 = .*|$2 = $3|" "$settings"
  grep -q "^$2 = $3" "$settings" || fail "the settings have no $1.$2"
}
# Settings for small, quick models; a camera is named by its link.
small_settings() {
  set_key camera backend '"v4l2"'
  set_key camera device "\"$1\""
  set_key camera width_px 320
  set_key camera height_px 240
  set_key camera rate_hz 30
  set_key trigger chip '"rigpanel"'
  set_key trigger line 3
  # Three seconds: what the script holds for a tenth may take the guest a whole one.
  set_key trigger long_press_ms 3000
  set_key indicator chip '"rigpanel"'
  set_key indicator light_line 5
  set_key storage reserve_mb 20
  set_key storage warn_mb 10
  set_key reconstruction preset '"preview"'
}
service_up() {
  systemctl reset-failed trigmesh.service 2>/dev/null || true
  timeout 100 systemctl restart trigmesh.service || fail "the service does not start: $(systemctl status --no-pager trigmesh.service)"
}
status() { trigmesh status --json | jq --raw-output ".$1"; }
phase_is() { [ "$(status phase)" = "$1" ]; }
wait_phase() { wait_until "${2:-60}" "the rig is $1" phase_is "$1"; }
sessions() { find $store -mindepth 1 -maxdepth 1 -type d -name '[0-9]*' | sort; }
session_count() { sessions | wc -l; }
newest() { sessions | tail -1; }
frame_count() { find "$1/frames" -name '*.jpg' | wc -l; }
has_frames() { [ "$(frame_count "$1")" -ge "$2" ]; }
state_of() { jq --raw-output .state "$1/session.json"; }
state_is() { [ "$(state_of "$1")" = "$2" ]; }
said() { journalctl --quiet --no-pager --unit=trigmesh.service --grep="$1" >/dev/null; }
restarts() { systemctl show --property=NRestarts --value trigmesh.service; }
main_pid() { systemctl show --property=MainPID --value trigmesh.service; }
descriptors() { ls "/proc/$(main_pid)/fd" | wc -l; }

# ---- what was stored
# Every stored frame is one of those that the camera showed: all_frames_are SESSION FOLDER
all_frames_are() {
  local known=known.txt wrong
  sha256sum "$2"/*.jpg | cut -d' ' -f1 | sort -u >$known
  wrong=$(sha256sum "$1"/frames/*.jpg | grep -v -F -f $known || true)
  [ -z "$wrong" ] || fail "frames that the camera never showed: $wrong"
}
# The line of rig_check_store of a session
told() { rig_check_store $store | grep "^session $(basename "$1") " ; }
check_store() { rig_check_store $store "$@" || fail "the store is not right"; }

# ---- questions for wait_until
session_has() { [ "$(session_count)" -gt 0 ] && [ "$(frame_count "$(newest)")" -ge "$1" ]; }
# newer_has SESSION N: there is a later session, with N frames
newer_has() { [ "$(newest)" != "$1" ] && session_has "$2"; }
is_closed() { case $(state_of "$1") in capturing | interrupted) return 1 ;; esac; }
ended() { state_is "$1" model_ready || state_is "$1" model_failed; }
both_ended() { ended "$1" && ended "$2"; }
camera_is() { [ "$(status camera_present)" = "$1" ]; }
fault_tells() { status fault | grep -q "$1"; }
storage_is() { [ "$(status storage)" = "$1" ]; }
pid_is_not() { local now; now=$(main_pid); [ "$now" != "$1" ] && [ "$now" != 0 ] && systemctl is-active --quiet trigmesh.service; }
is_gone() { [ ! -e "/proc/$1" ]; }
# answered SESSION PRESSES: kept frames and missed ones make up all presses
answered() {
  local kept missed
  kept=$(frame_count "$1")
  missed=$(journalctl --quiet --no-pager --unit=trigmesh.service --grep='press .*(missed|no frame|refused)' | wc -l)
  [ $((kept + missed)) -ge "$2" ]
}

# ---- the light, read back from the line: samples of about three seconds
light_samples() {
  local value
  value=$(line 5)/value
  for _ in $(seq 25); do
    cat "$value"
    pause 0.1
  done
}
light_is_steady() { [ "$(light_samples | sort -u)" = 1 ]; }
light_blinks() { [ "$(light_samples | sort -u | wc -l)" -eq 2 ]; }

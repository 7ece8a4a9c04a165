# Sourced by the scripts that try the tree in a clean Debian: make_clean_root, in_clean_root.

# make_clean_root SUITE SOURCES KEEP: a minimal root of a Debian release with a clone of what is committed in /trigmesh. SOURCES is a
# line of sources.list or a file of them. Removed when the script ends, unless KEEP is yes. Sets clean_root.
make_clean_root() {
  local suite=$1 sources=$2 keep=$3 repository place line
  repository=$(git -C "$(dirname "$(readlink -f "$0")")" rev-parse --show-toplevel)
  place=$(mktemp -d "${TMPDIR:-/tmp}/trigmesh-debian.XXXXXX")
  clean_root="$place/root"
  if [ "$keep" = no ]; then
    # shellcheck disable=SC2064  # the place of now
    trap "rm -rf --one-file-system '$place'" EXIT
  else
    trap "echo 'kept: $place'" EXIT
  fi
  # Nothing of it has to outlive a power cut, and packages are unpacked several times as fast.
  local options=(--aptopt='APT::Install-Recommends "false"' --dpkgopt=force-unsafe-io)
  while IFS= read -r line; do
    options+=("--aptopt=$line")
  done < <(apt-config dump | grep -E '^Acquire::(https?::Proxy|Check-)' || true)
  echo "making a clean Debian $suite in $clean_root"
  mmdebstrap --quiet --mode=root --variant=minbase "${options[@]}" "$suite" "$clean_root" "$sources"
  cp /etc/resolv.conf /etc/hosts "$clean_root/etc/"
  mkdir -p "$clean_root/usr/local/share/ca-certificates"
  cp /usr/local/share/ca-certificates/*.crt "$clean_root/usr/local/share/ca-certificates/" 2>/dev/null || true
  git clone --quiet --no-hardlinks "$repository" "$clean_root/trigmesh"
}

# in_clean_root COMMAND..: as root in it, in a mount namespace of its own, so that nothing stays mounted.
in_clean_root() {
  unshare --mount bash -c 'mount -t proc proc "$0/proc" && exec chroot "$0" "${@}"' "$clean_root" \
    /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb LC_ALL=C.UTF-8 \
    NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt "$@"
}

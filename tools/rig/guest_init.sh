#!/bin/busybox sh
# First process of the guest: load modules, put a writable overlay in memory over the host's root, start the agent.
# The kernel's command line has: rig_python=PATH rig_agent=PATH
B=/bin/busybox
$B mount -t proc p /proc; $B mount -t sysfs s /sys; $B mount -t devtmpfs d /dev
for module in $($B cat /modules.txt); do $B insmod /modules/$module || echo "rig: cannot load $module"; done
$B mount -t 9p -o trans=virtio,version=9p2000.L,ro,msize=1048576,cache=loose host /lower || echo "rig: no 9p"
$B mount -t tmpfs -o size=75% t /ram; $B mkdir /ram/upper /ram/work
$B mount -t overlay -o lowerdir=/lower,upperdir=/ram/upper,workdir=/ram/work o /new || echo "rig: no overlay"
for folder in dev proc sys; do $B mount --move /$folder /new/$folder; done
$B mkdir -p /new/dev/pts /new/dev/shm; $B mount -t devpts p /new/dev/pts; $B mount -t tmpfs -o mode=1777 t /new/dev/shm
$B mount -t tmpfs t /new/run; $B mkdir -p -m 1777 /new/run/tmp
# other people's rules for the brick would hide what ours do
$B rm -f /new/lib/udev/rules.d/*nbc.rules /new/usr/lib/udev/rules.d/*nbc.rules /new/etc/udev/rules.d/*nxtdrive.rules
$B ip link set lo up; $B ip addr add 10.0.2.15/24 dev eth0; $B ip link set eth0 up
for word in $($B cat /new/proc/cmdline); do case $word in rig_python=*|rig_agent=*) eval "${word%%=*}='${word#*=}'";; esac; done
export TMPDIR=/run/tmp PYTHONDONTWRITEBYTECODE=1 HOME=/root TERM=xterm LC_ALL=C.UTF-8
export PATH=${rig_python%/*}:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
$B chmod 755 /new/root  # so that other users than root can read an interpreter that lies there
exec $B chroot /new /usr/bin/env "$rig_python" "$rig_agent"

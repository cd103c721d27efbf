# Sourced after expect.sh by the tests that run lumid on a board of their own: in $scratch; $daemon and $board end with them.
cd "$scratch" || exit 1
daemon= board=
stop_all() {
    for process in $daemon $board; do
        kill -9 "$process" 2>/dev/null
    done
    chmod -R u+w "$scratch"
    rm -rf "$scratch"
}
trap stop_all EXIT
unset NOTIFY_SOCKET WATCHDOG_USEC JOURNAL_STREAM LUMID_TOKEN

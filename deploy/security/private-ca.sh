#!/bin/sh
# A private certificate authority for one site: needs openssl, nothing else.
#
#   private-ca.sh init  DIR                      make the authority (DIR/ca.pem, DIR/ca.key: keep the key off the plant net)
#   private-ca.sh issue DIR NAME [HOST ...]      make DIR/NAME/ with ca.pem, certificate.pem, key.pem; NAME is the common
#                                                name that [security] of the configuration knows; the daemon needs the
#                                                hosts (names or addresses) at which leaves reach it
#
# DAYS sets how long a certificate is valid (default 825; the authority 3650). Issue anew before it ends, then restart.
set -eu
umask 077
usage() { sed -n '2,10s/^# \{0,1\}//p' "$0" >&2; exit 2; }
fail() { echo "private-ca.sh: $1" >&2; exit 2; }
command -v openssl >/dev/null || fail "needs openssl on PATH"
[ $# -ge 2 ] || usage
action=$1 dir=$2

key() { openssl ecparam -name prime256v1 -genkey -noout 2>/dev/null | openssl pkcs8 -topk8 -nocrypt -out "$1"; }

case $action in
init)
    [ ! -e "$dir/ca.key" ] || fail "$dir/ca.key exists: an authority is made once"
    mkdir -p "$dir"
    key "$dir/ca.key"
    openssl req -x509 -new -sha256 -key "$dir/ca.key" -days "${DAYS:-3650}" -subj "/CN=tribowatch private authority" \
        -addext "basicConstraints=critical,CA:TRUE,pathlen:0" -addext "keyUsage=critical,keyCertSign,cRLSign" \
        -out "$dir/ca.pem"
    echo "authority in $dir: guard ca.key"
    ;;
issue)
    [ $# -ge 3 ] || usage
    name=$3
    shift 3
    [ -r "$dir/ca.key" ] || fail "$dir/ca.key is missing: begin with 'private-ca.sh init $dir'"
    case $name in *[!A-Za-z0-9_.-]*|"") fail "NAME is '$name', but must be of A-Z a-z 0-9 _ . -" ;; esac
    alt="DNS:$name"
    for host in "$@"; do
        case $host in
            *:*|*[0-9].[0-9]*) alt="$alt,IP:$host" ;;
            *) alt="$alt,DNS:$host" ;;
        esac
    done
    mkdir -p "$dir/$name"
    key "$dir/$name/key.pem"
    extensions=$(mktemp)
    trap 'rm -f "$extensions" "$extensions.csr"' EXIT
    printf 'subjectAltName=%s\nbasicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\nextendedKeyUsage=serverAuth,clientAuth\n' \
        "$alt" > "$extensions"
    openssl req -new -sha256 -key "$dir/$name/key.pem" -subj "/CN=$name" -out "$extensions.csr"
    openssl x509 -req -sha256 -in "$extensions.csr" -CA "$dir/ca.pem" -CAkey "$dir/ca.key" -CAcreateserial \
        -days "${DAYS:-825}" -extfile "$extensions" -out "$dir/$name/certificate.pem" 2>/dev/null
    cp "$dir/ca.pem" "$dir/$name/ca.pem"
    echo "identity of $name in $dir/$name: move it to its machine, as TRIBOWATCH_IDENTITY or [security] identity"
    ;;
*) usage ;;
esac

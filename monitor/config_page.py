"""The `[page]` section of the configuration: where the page listens, and who may come in."""

from __future__ import annotations

from pydantic import Field

from monitor.config_sections import Section

ADDRESS_FILE = "page.url"  # in the state directory, while the page is served


class PageSection(Section):
    """The page in the browser, the HTTP API behind it and /metrics; see docs/page.md."""

    listen: str = Field(default="127.0.0.1:8447", description="HOST:PORT; port 0 = any free one; empty = no page")
    hosts: tuple[str, ...] = Field(default=(), description="further names it is reached by (proxy); need tokens")
    token_file: str = Field(
        default="", description="from `tribowatch token add`; needed unless listen is this computer's own loopback"
    )
    certificate: str = Field(default="", description="PEM, with private_key: HTTPS")
    private_key: str = Field(default="", description="PEM of the certificate's key")
    requests_per_minute: int = Field(default=600, ge=1, description="of one client address; beyond it 429 [1/min]")
    unhealthy_after: float = Field(
        default=30.0,
        gt=0,
        allow_inf_nan=False,
        description="/healthz answers 503 when the daemon has not come round for this long [s]",
    )
    viewers: int = Field(
        default=100, ge=1, description="pages that are kept up to date at the same time; beyond it 503"
    )

"""Parts that several nodes share: start, messages, transforms, diagnostics.

Reading order: `readiness`, `conversions`, `nav_messages`, `transforms`,
`diagnostics`, `preflight`, `rviz_nodes`.
"""

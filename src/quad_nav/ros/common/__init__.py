"""Parts that several nodes share: messages, transforms, names, diagnostics.

Reading order: `node_tools`, `conversions`, `nav_messages`, `transforms`,
`readiness`, `diagnostics`, `preflight`, `rviz_node`.
"""

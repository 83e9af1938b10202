"""Read what users give: YAML, goal and scene files, within limits.

Reading order: ``user_files`` opens files safely, ``plain_yaml`` and ``document`` read YAML and
check it field by field, ``xml_tree`` reads XML, ``values`` has the rules for single values,
``shipped`` finds the files that come with the package.
"""

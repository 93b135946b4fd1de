"""From layouts to the JSON documents of the contract, and those of older versions."""

"""From layouts to the JSON documents of the contract, and from those of older versions."""
